/* The first of the degenerate scenes of long_degenerate_scenes. */
#define DEGENERATE_SCENES 16
#include "long_degenerate_scenes.c"
