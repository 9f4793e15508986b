/* When to estimate a render's noise (a look), and when the noise will reach its target.
 *
 * The square of the noise falls as one over the passes, so that from a look at n passes the target needs n (noise /
 * target)^2 of them. The next look is at that number, but not beyond 2 n, for the estimate may be wrong, and at least
 * n / 32 further. Looks are few, since the estimated noise scatters: with a look after every pass a render would stop
 * at the first estimate below the target, and an image that is stopped because its estimate is low has more often
 * missed its rare bright paths. The look at the predicted number of passes keeps the render from running on to the
 * next doubling, up to twice as long as needed.
 *
 * A picture that stays black has no noise, and never reaches a target: it is given up at the first look after so many
 * passes as the render has patience for (ca_noise_looks_patience).
 *
 * Passes are real numbers: renders whose iterations differ count them by their precision. */
#ifndef CA_RENDER_NOISE_LOOKS_H
#define CA_RENDER_NOISE_LOOKS_H

#include <stdbool.h>

typedef struct ca_noise_looks {
    double target;   /* percent; 0: none */
    double patience; /* passes without light after which the render is given up */
    bool given_up;   /* at the last look */
    double next;     /* passes at the next look */
    double noise;    /* percent, at the last look; negative: not known */
    double seconds_predicted;                           /* of the whole render; 0: not known */
    double first_predicted_seconds, first_predicted_at; /* the first prediction, and when it was made; 0: none yet */
} ca_noise_looks;

/* `first`: passes at the first look; patience >= first. */
ca_noise_looks ca_noise_looks_start(double target, double first, double patience);

/* Samples of each of so many pixels after which a black picture is given up: where there is light they are 2^24, but
 * at least 64 of a pixel and at most 4096; where there is none, none. */
double ca_noise_looks_patience(double pixels, bool has_light);

static inline bool ca_noise_looks_due(const ca_noise_looks *looks, double passes) { return passes >= looks->next; }

/* Notes the noise (percent; NAN: not known) after `passes` and `seconds`; passes to come are expected to take
 * `seconds_per_pass`. */
void ca_noise_looks_take(ca_noise_looks *looks, double passes, double noise, double seconds, double seconds_per_pass);

/* What a render that goes on knows of its last look. */
void ca_noise_looks_recall(ca_noise_looks *looks, double noise, double next);

/* Was the target reached at the last look? */
static inline bool ca_noise_looks_reached(const ca_noise_looks *looks)
{
    return looks->target > 0.0 && looks->noise >= 0.0 && looks->noise < looks->target;
}

/* Does the last look end the render? */
static inline bool ca_noise_looks_over(const ca_noise_looks *looks)
{
    return ca_noise_looks_reached(looks) || looks->given_up;
}

#endif
