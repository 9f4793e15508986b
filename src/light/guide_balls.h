/* Balls around points: a set of points in space is cut into clusters, and each gets a ball that holds its points. For
 * guided emission (emission_guide.h). Internal to this folder. */
#ifndef CA_LIGHT_GUIDE_BALLS_H
#define CA_LIGHT_GUIDE_BALLS_H

#include "light/emission_guide.h"

enum { CA_GUIDE_MOST_BALLS = 17 };

/* The first ball holds all points, the others a cluster each; `density` of each is set to the share of the points'
 * weight that is in it. Returns how many there are: CA_GUIDE_MOST_BALLS at most, none of few points. The order of the
 * points changes. */
uint32_t ca_guide_balls(ca_guide_sample *points, size_t count, float least_radius,
                        ca_guide_ball balls[CA_GUIDE_MOST_BALLS]);

#endif
