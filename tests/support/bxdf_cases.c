#include "support/bxdf_cases.h"

#include "material/fresnel.h"
#include "material/microfacet.h"
#include "material/rough_transmittance.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

enum { MAX_CASES = 100 };

static const ca_rgb white = {1.0f, 1.0f, 1.0f};
/* Near gold: complex indices of the three primaries. */
static const ca_rgb metal_eta = {0.14f, 0.37f, 1.44f}, metal_k = {4.0f, 2.4f, 1.6f};

static ca_bxdf_case *add(ca_bxdf_cases *list, const char *name, ca_bxdf bxdf)
{
    assert_true(list->count < MAX_CASES);
    ca_bxdf_case *entry = &list->cases[list->count++];
    *entry = (ca_bxdf_case){.bxdf = bxdf, .is_physical = true};
    snprintf(entry->name, sizeof entry->name, "%s", name);
    entry->two_sided = (ca_bxdf_scatter(&bxdf) & CA_SCATTER_TRANSMISSION) != 0;
    return entry;
}

static void add_smooth(ca_bxdf_cases *list)
{
    add(list, "diffuse", (ca_bxdf){.kind = CA_BXDF_DIFFUSE, .as.diffuse = {white}})->lossless = true;
    static const float eta[4] = {1.5f, 0.7f, 2.4f, 1.0f};
    char name[80];
    for (int i = 0; i < 4; ++i) {
        snprintf(name, sizeof name, "dielectric eta %.2g", (double)eta[i]);
        add(list, name,
            (ca_bxdf){.kind = CA_BXDF_DIELECTRIC,
                      .as.dielectric = {.eta = eta[i], .reflectance = white, .transmittance = white}})
            ->lossless = true;
        snprintf(name, sizeof name, "thin dielectric eta %.2g", (double)eta[i]);
        add(list, name,
            (ca_bxdf){.kind = CA_BXDF_THIN_DIELECTRIC,
                      .as.thin_dielectric = {.eta = eta[i], .reflectance = white, .transmittance = white}})
            ->lossless = true;
    }
    add(list, "conductor",
        (ca_bxdf){.kind = CA_BXDF_CONDUCTOR, .as.conductor = {metal_eta, metal_k, .reflectance = white}});
    add(list, "mirror",
        (ca_bxdf){.kind = CA_BXDF_CONDUCTOR,
                  .as.conductor = {.eta = {0.0f, 0.0f, 0.0f}, .k = white, .reflectance = white}})
        ->lossless = true;
    for (int nonlinear = 0; nonlinear < 2; ++nonlinear) {
        const ca_bxdf plastic = {.kind = CA_BXDF_PLASTIC,
                                 .as.plastic = {.diffuse = nonlinear ? (ca_rgb){0.9f, 0.5f, 0.1f} : white,
                                                .specular = white,
                                                .eta = 1.49f,
                                                .internal_transmittance =
                                                    ca_fresnel_diffuse_transmittance(1.0f / 1.49f),
                                                .specular_weight = nonlinear ? 0.7f : 0.5f,
                                                .nonlinear = nonlinear}};
        add(list, nonlinear ? "plastic, nonlinear" : "plastic, white", plastic)->lossless = !nonlinear;
    }
}

static void add_rough(ca_bxdf_cases *list, ca_microfacet facets)
{
    char name[80];
    const char *kind = facets.kind == CA_MICROFACET_GGX ? "GGX" : "Beckmann";
    const char *normals = facets.sample_visible ? "" : ", all normals";
    const double x = (double)facets.alpha_x, y = (double)facets.alpha_y;
    snprintf(name, sizeof name, "rough conductor, %s %.3g %.3g%s", kind, x, y, normals);
    add(list, name,
        (ca_bxdf){.kind = CA_BXDF_ROUGH_CONDUCTOR,
                  .as.rough_conductor = {metal_eta, metal_k, .reflectance = white, .facets = facets}});
    snprintf(name, sizeof name, "rough dielectric, %s %.3g %.3g%s", kind, x, y, normals);
    add(list, name,
        (ca_bxdf){
            .kind = CA_BXDF_ROUGH_DIELECTRIC,
            .as.rough_dielectric = {
                .eta = x > 0.3 ? 0.75f : 1.5f, .reflectance = white, .transmittance = white, .facets = facets}});
}

static void add_rough_plastic(ca_bxdf_cases *list, ca_microfacet_kind kind, float alpha, bool nonlinear)
{
    char name[80];
    snprintf(name, sizeof name, "rough plastic, %s %.3g%s", kind == CA_MICROFACET_GGX ? "GGX" : "Beckmann",
             (double)alpha, nonlinear ? ", nonlinear" : "");
    ca_rough_transmittance *table = ca_rough_transmittance_create(kind, alpha, 1.49f);
    assert_non_null(table);
    add(list, name,
        (ca_bxdf){.kind = CA_BXDF_ROUGH_PLASTIC,
                  .as.rough_plastic = {.diffuse = nonlinear ? (ca_rgb){0.9f, 0.5f, 0.1f} : white,
                                       .specular = white,
                                       .eta = 1.49f,
                                       .internal_transmittance = ca_rough_transmittance_from_inside(table),
                                       .specular_weight = 0.6f,
                                       .nonlinear = nonlinear,
                                       .facets = ca_microfacet_make(kind, alpha, alpha, !nonlinear),
                                       .transmittance = table}})
        ->table = table;
}

/* The principled model invents light at grazing angles where base, sheen and coat add up: only those sets are
 * physical that switch them off. */
static void add_principled(ca_bxdf_cases *list)
{
    const ca_bxdf plain = {.kind = CA_BXDF_PRINCIPLED,
                           .as.principled = {.base_color = {0.8f, 0.5f, 0.2f},
                                             .roughness = 0.5f,
                                             .eta = 1.5f,
                                             .diffuse_rate = 1.0f,
                                             .specular_rate = 1.0f,
                                             .clearcoat_rate = 1.0f}};
    ca_bxdf b = plain;
    add(list, "principled, plain", b)->is_physical = false;

    b.as.principled.flatness = 0.7f;
    b.as.principled.sheen = 0.8f;
    b.as.principled.sheen_tint = 0.5f;
    b.as.principled.clearcoat = 1.0f;
    b.as.principled.clearcoat_gloss = 0.3f;
    b.as.principled.spec_tint = 0.6f;
    add(list, "principled, coated cloth", b)->is_physical = false;

    b.as.principled.metallic = 0.3f;
    b.as.principled.spec_trans = 0.6f;
    b.as.principled.anisotropic = 0.7f;
    b.as.principled.diffuse_rate = 0.5f;
    b.as.principled.clearcoat_rate = 2.0f;
    add(list, "principled, everything", b)->is_physical = false;

    b = plain;
    b.as.principled.metallic = 1.0f;
    b.as.principled.roughness = 0.3f;
    b.as.principled.anisotropic = 0.8f;
    add(list, "principled, metal", b);

    b = plain;
    b.as.principled.spec_trans = 1.0f;
    b.as.principled.base_color = white;
    add(list, "principled, glass", b);
    b.as.principled.eta = 1.0f;
    add(list, "principled, glass of index 1", b);
}

/* Where base and sheen add up at grazing angles it invents light too; diffuse, half of it through, it does not. */
static void add_principled_thin(ca_bxdf_cases *list)
{
    ca_bxdf b = {.kind = CA_BXDF_PRINCIPLED_THIN,
                 .as.principled_thin = {.base_color = {0.8f, 0.5f, 0.2f}, .roughness = 0.6f, .eta = 1.5f}};
    add(list, "thin principled, paper", b)->is_physical = false;
    b.as.principled_thin.diff_trans = 0.5f;
    b.as.principled_thin.sheen = 0.7f;
    b.as.principled_thin.sheen_tint = 0.4f;
    b.as.principled_thin.flatness = 0.5f;
    b.as.principled_thin.spec_trans = 0.4f;
    b.as.principled_thin.spec_tint = 0.6f;
    b.as.principled_thin.anisotropic = 0.7f;
    add(list, "thin principled, everything", b)->is_physical = false;
    b = (ca_bxdf){.kind = CA_BXDF_PRINCIPLED_THIN,
                  .as.principled_thin = {.base_color = white, .roughness = 0.9f, .eta = 1.8f, .spec_trans = 1.0f}};
    add(list, "thin principled, glass", b);
    b.as.principled_thin.spec_trans = 0.0f;
    b.as.principled_thin.diff_trans = 1.0f;
    add(list, "thin principled, a perfect screen", b)->lossless = true;
}

static void add_ward(ca_bxdf_cases *list)
{
    static const char *const names[3] = {"balanced", "Duer", "1992"};
    static const struct {
        ca_ward_variant variant;
        float x, y;
    } all[5] = {{CA_WARD_BALANCED, 0.3f, 0.3f},
                {CA_WARD_BALANCED, 0.1f, 0.4f},
                {CA_WARD_BALANCED, 0.02f, 0.02f},
                {CA_WARD_DUER, 0.4f, 0.3f},
                {CA_WARD_1992, 0.3f, 0.1f}};
    char name[80];
    for (int i = 0; i < 5; ++i) {
        snprintf(name, sizeof name, "Ward, %s %.2g %.2g", names[all[i].variant], (double)all[i].x, (double)all[i].y);
        ca_bxdf_case *entry = add(list, name,
                                  (ca_bxdf){.kind = CA_BXDF_WARD,
                                            .as.ward = {.diffuse = {0.4f, 0.3f, 0.2f},
                                                        .specular = {0.5f, 0.6f, 0.3f},
                                                        .alpha_x = all[i].x,
                                                        .alpha_y = all[i].y,
                                                        .specular_weight = 0.6f,
                                                        .variant = all[i].variant}});
        entry->is_physical = all[i].variant == CA_WARD_BALANCED;
    }
}

static void add_old_models(ca_bxdf_cases *list)
{
    char name[80];
    for (int i = 0; i < 3; ++i) {
        static const float sigma[3] = {0.0f, 0.2f, 0.8f}, exponent[3] = {0.0f, 30.0f, 300.0f};
        const ca_rgb paint = {0.9f, 0.5f, 0.1f};
        snprintf(name, sizeof name, "rough diffuse %.1f", (double)sigma[i]);
        add(list, name,
            (ca_bxdf){.kind = CA_BXDF_ROUGH_DIFFUSE, .as.rough_diffuse = {.reflectance = paint, .sigma = sigma[i]}});
        snprintf(name, sizeof name, "Phong %.0f", (double)exponent[i]);
        add(list, name,
            (ca_bxdf){.kind = CA_BXDF_PHONG,
                      .as.phong = {.diffuse = {0.4f, 0.3f, 0.2f},
                                   .specular = {0.5f, 0.6f, 0.3f},
                                   .exponent = exponent[i],
                                   .specular_weight = 0.6f}});
    }
}

static void add_transmitter(ca_bxdf_cases *list)
{
    add(list, "diffuse transmitter",
        (ca_bxdf){.kind = CA_BXDF_DIFFUSE_TRANSMITTER,
                  .as.diffuse_transmitter.transmittance = {0.9f, 0.5f, 0.1f}});
}

static void assert_all_models(const ca_bxdf_cases *list)
{
    bool there[CA_BXDF_KIND_COUNT] = {false};
    for (uint32_t i = 0; i < list->count; ++i) there[list->cases[i].bxdf.kind] = true;
    for (int kind = 0; kind < CA_BXDF_KIND_COUNT; ++kind)
        if (!there[kind]) fail_msg("no case of BSDF kind %d", kind);
}

ca_bxdf_cases ca_bxdf_cases_create(void)
{
    ca_bxdf_cases list = {.cases = calloc(MAX_CASES, sizeof(ca_bxdf_case))};
    assert_non_null(list.cases);
    add_smooth(&list);
    static const float alpha[5][2] = {{0.01f, 0.01f}, {0.1f, 0.1f}, {0.5f, 0.5f}, {1.0f, 1.0f}, {0.05f, 0.4f}};
    for (int kind = 0; kind < 2; ++kind) {
        for (int i = 0; i < 5; ++i)
            add_rough(&list, ca_microfacet_make((ca_microfacet_kind)kind, alpha[i][0], alpha[i][1], true));
        add_rough(&list, ca_microfacet_make((ca_microfacet_kind)kind, 0.5f, 0.2f, false));
    }
    add(&list, "rough dielectric, index-matched",
        (ca_bxdf){.kind = CA_BXDF_ROUGH_DIELECTRIC,
                  .as.rough_dielectric = {.eta = 1.0f,
                                          .reflectance = white,
                                          .transmittance = white,
                                          .facets = ca_microfacet_make(CA_MICROFACET_GGX, 0.3f, 0.3f, true)}})
        ->lossless = true;
    add_rough_plastic(&list, CA_MICROFACET_BECKMANN, 0.1f, false);
    add_rough_plastic(&list, CA_MICROFACET_GGX, 0.02f, false);
    add_rough_plastic(&list, CA_MICROFACET_GGX, 0.5f, true);
    add_principled(&list);
    add_principled_thin(&list);
    add_ward(&list);
    add_old_models(&list);
    add_transmitter(&list);
    assert_all_models(&list);
    return list;
}

void ca_bxdf_cases_destroy(ca_bxdf_cases *list)
{
    for (uint32_t i = 0; i < list->count; ++i) ca_rough_transmittance_destroy(list->cases[i].table);
    free(list->cases);
    *list = (ca_bxdf_cases){.count = 0};
}

ca_bxdf_cases ca_test_bxdfs;

int ca_test_bxdfs_make(void **state)
{
    (void)state;
    ca_test_bxdfs = ca_bxdf_cases_create();
    return 0;
}

int ca_test_bxdfs_free(void **state)
{
    (void)state;
    ca_bxdf_cases_destroy(&ca_test_bxdfs);
    return 0;
}

ca_vec3 ca_test_direction(float cosine, float azimuth)
{
    const double c = (double)cosine, sine = sqrt(fmax(0.0, 1.0 - c * c));
    return (ca_vec3){(float)(sine * cos((double)azimuth)), (float)(sine * sin((double)azimuth)), cosine};
}

ca_vec3 ca_test_incidence(uint32_t index, bool below)
{
    static const float cosine[CA_TEST_INCIDENCE_COUNT] = {1.0f, 0.8f, 0.4f, 0.06f};
    static const float azimuth[CA_TEST_INCIDENCE_COUNT] = {0.0f, 0.7f, 2.6f, -1.9f};
    return ca_test_direction(below ? -cosine[index] : cosine[index], azimuth[index]);
}
