/* What a unit of each of two kinds of work costs, from samples of work done and time taken:
 *
 *     seconds = units[0] cost[0] + units[1] cost[1], both costs at least 0.
 *
 * Least squares of relative deviations, since a sample of twice the work scatters twice as far; samples that lie far
 * off what the others say (an interrupt, a page fault) lose their weight (Tukey's bisquare, after steps with Huber's
 * weights that do not need a good start).
 *
 * Where the two kinds have the same ratio in all samples, only the sum of their times can be estimated. So a prior is
 * added for the cost of the second kind relative to the first. It has no influence where the samples determine both
 * costs. Where they do not, it decides, and the standard errors are as large as its own. (Its value for the first
 * kind is what all samples together give, with a relative standard deviation of 1.)
 *
 * Standard errors come from the scatter of the samples, as if they were independent and the model were right. */
#ifndef CA_RENDER_COST_FIT_H
#define CA_RENDER_COST_FIT_H

#include <stddef.h>

typedef struct ca_cost_sample {
    double units[2], seconds; /* >= 0 */
} ca_cost_sample;

/* The prior: cost[1] / cost[0], and its standard deviation > 0. */
typedef struct ca_cost_guess {
    double ratio, deviation;
} ca_cost_guess;

typedef struct ca_cost_fit {
    double cost[2], error[2]; /* NAN: there was no work of this kind */
} ca_cost_fit;

/* `scratch`: room for `count` numbers. Cost: some twenty sweeps over the samples. */
ca_cost_fit ca_fit_costs(const ca_cost_sample *samples, size_t count, ca_cost_guess guess, double *scratch);

#endif
