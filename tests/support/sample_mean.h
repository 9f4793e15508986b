/* Mean and scatter of independent values, from their sums; for values whose mean is not much larger than their
 * scatter. */
#ifndef CA_TEST_SAMPLE_MEAN_H
#define CA_TEST_SAMPLE_MEAN_H

#include <math.h>

typedef struct sample_mean {
    double sum, squares;
} sample_mean;

static inline void add_sample(sample_mean *m, double value)
{
    m->sum += value;
    m->squares += value * value;
}

/* Of one value. */
static inline double deviation_of(const sample_mean *m, double count)
{
    return sqrt(fmax(0.0, m->squares / count - m->sum / count * (m->sum / count)) * count / (count - 1.0));
}

/* Of the mean. */
static inline double error_of(const sample_mean *m, double count) { return deviation_of(m, count) / sqrt(count); }

#endif
