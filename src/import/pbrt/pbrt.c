#include "import/pbrt/pbrt.h"

#include "import/tree_build.h"

void ca_read_pbrt(ca_importer *importer)
{
    ca_tree tree;
    ca_tree_begin(&tree, importer);
    ca_tree_end(&tree);
}
