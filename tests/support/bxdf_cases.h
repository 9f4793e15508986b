/* Named elementary BSDFs that between them cover every model, distribution and range of roughness: the statistical
 * and algebraic tests run over all of them. */
#ifndef CA_TEST_BXDF_CASES_H
#define CA_TEST_BXDF_CASES_H

#include "material/bxdf.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct ca_bxdf_case {
    char name[80];
    ca_bxdf bxdf;
    struct ca_rough_transmittance *table; /* of a rough plastic, else NULL */
    bool two_sided;   /* scatters light that comes from below, too */
    bool lossless;    /* gives back all light, to rounding */
    bool is_physical; /* never gives back more than it gets */
} ca_bxdf_case;

/* The list; its tables belong to it. */
typedef struct ca_bxdf_cases {
    ca_bxdf_case *cases;
    uint32_t count;
} ca_bxdf_cases;

ca_bxdf_cases ca_bxdf_cases_create(void);
void ca_bxdf_cases_destroy(ca_bxdf_cases *list);

/* One list for all tests of a group, with the group's setup and teardown. */
extern ca_bxdf_cases ca_test_bxdfs;
int ca_test_bxdfs_make(void **state);
int ca_test_bxdfs_free(void **state);

/* A unit direction from its cosine (negative: below) and azimuth. */
ca_vec3 ca_test_direction(float cosine, float azimuth);

/* Directions of incidence: normal, middling, grazing; each once. Multiply z by -1 for those from below. */
enum { CA_TEST_INCIDENCE_COUNT = 4 };
ca_vec3 ca_test_incidence(uint32_t index, bool below);

#endif
