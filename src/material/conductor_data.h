/* Complex indices of refraction of named metals (and some other absorbing or dense materials), relative to vacuum. */
#ifndef CA_MATERIAL_CONDUCTOR_DATA_H
#define CA_MATERIAL_CONDUCTOR_DATA_H

#include "math/rgb.h"

#include <stddef.h>

typedef struct ca_conductor {
    const char *name;
    ca_rgb eta, k;
} ca_conductor;

/* NULL where there is none of that name. "none" is the perfect mirror, eta 0 and k 1. */
const ca_conductor *ca_conductor_find(const char *name);

/* All of them, sorted as in the table: for error messages and documentation. */
const ca_conductor *ca_conductor_table(size_t *count);

#endif
