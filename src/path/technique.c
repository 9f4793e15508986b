#include "path/technique.h"

const char *ca_technique_name(ca_technique technique)
{
    static const char *const names[CA_TECHNIQUE_COUNT] = {"hit", "next_event", "connect", "splat", "merge"};
    return names[technique];
}
