/* The method that integrator `auto` takes, decided: pure functions from what trials and the light pilot tell of each
 * method to which of them go on, which others are worth a trial, and which is best. Nothing is rendered or timed
 * here; auto_method.h does what is decided.
 *
 * The best method has the least error x time: what a fixed time leaves of the error, or a fixed error costs of
 * time. The error is variance, and the square of what merges blur. A method that will lose light in some part of the
 * picture is never taken, however cheap it looks. */
#ifndef CA_RENDER_METHOD_CHOICE_H
#define CA_RENDER_METHOD_CHOICE_H

#include "integrator/integrator.h"

typedef struct ca_method {
    const ca_integrator_type *type;
    bool no_splats;       /* of bdpt */
    bool unguided;        /* emission is as usual even where it can be guided (light/emission_guide.h) */
    int light_paths_log4; /* N_F in a pass is the usual number times 4 to this power */
} ca_method;

typedef struct ca_method_score {
    double variance; /* of an iteration, relative, mean over pixels: of the trial; without dots where there is: */
    double dots;     /* likewise, of dots that the trial has not met: by the pilot, or by how few photons it met */
    double shown;    /* likewise, of lights that are seen as they are: the same for all methods (shown_light.h) */
    double common;   /* of the variance what values bring that are not rare (CA_COMMON_SQUARE) */
    double least;    /* ca_method_noise is no less (ca_methods_compare_noise) */
    double seconds;  /* of one processor, that an iteration of the render is expected to take */
    double passes;   /* iterations of the whole render */
    double blur;     /* the square of what is blurred in these, relative likewise */
    bool loses_light;
} ca_method_score;

enum { CA_MOST_METHODS = CA_METHOD_TRIALS };

/* The methods that are tried first; returns how many. */
uint32_t ca_methods_first(ca_method methods[CA_MOST_METHODS]);
bool ca_method_has_light_paths(const ca_method *method);
/* Does it merge, and so find all light there is? */
bool ca_method_merges(const ca_method *method);

/* Values of a pixel are rare where their square, times the pixel's weight (about one over its squared luminance), is
 * larger: they count in `common` as if it were that. */
#define CA_COMMON_SQUARE 25.0

/* What the score tells of the noise, and more the rarer the values that make it: who meets few of them has not met
 * the rarest. */
double ca_method_noise(const ca_method_score *score);

/* What tells of the blur of a render. */
typedef struct ca_blur_signs {
    double by_pilot; /* what the radius' pilot says of these passes */
    double variance; /* of an iteration with the usual number of light paths and common values */
    double alpha, passes;
    double merged_alone; /* the share of the light that merges alone find */
} ca_blur_signs;

/* The mean square of what merges blur where the first radius was chosen for the least error
 * (photon/radius_choice.h), relative to a pixel's light: by that choice it is in proportion to the variance after
 * CA_RADIUS_PASSES passes, and far less of it where connections find light, too. That and what the pilot says are
 * guesses: their geometric mean is closer to what renders have than either. */
double ca_method_blur(const ca_method *method, const ca_blur_signs *signs);

/* Fewer light paths leave no less noise: sets `least` of each score to the most that is known of the same method with
 * as many or more. A trial of few light paths may not have met what is rare. */
void ca_methods_compare_noise(const ca_method *methods, ca_method_score *scores, uint32_t count);

/* The error of the whole render times the processor's time for it; INFINITY: never. */
double ca_method_cost(const ca_method_score *score);
/* The index of the least cost among `count` >= 1; the first of equals. */
uint32_t ca_method_best(const ca_method_score *scores, uint32_t count);
/* May it still turn out to be the best, after so many iterations of both? Costs are known the better the more
 * iterations there are. */
bool ca_method_goes_on(const ca_method_score *score, const ca_method_score *best, uint32_t iterations);

/* The same with emission that is as usual instead of guided, or the other way round; false where it has no light
 * paths, or has been tried. */
bool ca_method_other_emission(const ca_method *method, const ca_method *tried, uint32_t count, ca_method *other);

/* Four times as many light paths (`step` 1) or a quarter (-1): sets *neighbour; false where that goes too far, or has
 * been tried: is among `tried`. `most_log4`: the largest power allowed. */
bool ca_method_neighbour(const ca_method *method, int step, int most_log4, const ca_method *tried, uint32_t count,
                         ca_method *neighbour);

#endif
