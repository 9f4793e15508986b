/* The scenes of tests/mitsuba, each with one feature, against what Mitsuba 3 made of them: block means with their
 * standard errors, recorded in references.txt by scripts/check-mitsuba.py. */
#ifndef CA_TEST_MITSUBA_SCENES_H
#define CA_TEST_MITSUBA_SCENES_H

#include <stdbool.h>

/* Compares all scenes of the folder; with `own` by the integrator that the scene names, else by `path` and one of
 * `bdpt` and `ovcm` in turn. Fails the test where more than 1 % of the block values are further from Mitsuba's than
 * 3.3 standard errors, or one is further than 6, and where a scene of the folder is not recorded. Prints a line for
 * each scene and method. */
void compare_with_mitsuba(const char *folder, bool own);

#endif
