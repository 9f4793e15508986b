/* What tests of the program render with photons: a floor and a wall under a small lamp, 12 x 8 pixels. Included by
 * the test programs only. */
#ifndef CA_TEST_PROGRAM_ROOM_H
#define CA_TEST_PROGRAM_ROOM_H

#include "support/program_test.h"

enum { WIDTH = 12, HEIGHT = 8, PIXELS = WIDTH * HEIGHT };

/* `head`: definitions and the integrator, as XML; `sampler`, `samples` and the lamp's `power`: values, which may be
 * references. */
#define ROOM_TEXT(head, sampler, samples, power)                                                                     \
    "<scene version=\"3.0.0\">\n" head "  <sensor type=\"perspective\">\n"                                           \
    "    <float name=\"fov\" value=\"40\"/>\n"                                                                       \
    "    <transform name=\"to_world\"><lookat origin=\"0,3,6\" target=\"0,0.5,0\" up=\"0,1,0\"/></transform>\n"      \
    "    <sampler type=\"" sampler "\"><integer name=\"sample_count\" value=\"" samples "\"/></sampler>\n"           \
    "    <film type=\"hdrfilm\"><integer name=\"width\" value=\"12\"/><integer name=\"height\" value=\"8\"/>"        \
    "<rfilter type=\"box\"/></film>\n"                                                                               \
    "  </sensor>\n"                                                                                                  \
    "  <shape type=\"rectangle\"><transform name=\"to_world\"><rotate x=\"1\" angle=\"-90\"/><scale "                \
    "value=\"3\"/></transform>"                                                                                      \
    "</shape>\n"                                                                                                     \
    "  <shape type=\"rectangle\"><transform name=\"to_world\"><scale value=\"3\"/><translate "                       \
    "z=\"-2\"/></transform></shape>\n"                                                                               \
    "  <emitter type=\"point\"><point name=\"position\" value=\"0.5,2.5,0.5\"/><rgb name=\"intensity\" "             \
    "value=\"" power "\"/>"                                                                                          \
    "</emitter>\n"                                                                                                   \
    "</scene>\n"

#endif
