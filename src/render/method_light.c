#include "render/method_light.h"

/* A part of the picture has so many across and down, and counts where it has this share of all light. */
enum { PARTS = 8, AGREEING_BATCHES = 4 };
#define LEAST_LIGHT_OF_PART 1e-3

/* Shares that matter: of the picture; of a part, where chance paths alone lose a percent or two. */
#define LOST_OF_PICTURE 0.005
#define LOST_OF_PART 0.05

typedef struct part_light {
    double all, lost;
    uint32_t batches; /* bits: those in which some is lost */
} part_light;

static uint32_t part_along(uint32_t at, uint32_t begin, uint32_t end)
{
    const uint64_t part = (uint64_t)(at - begin) * PARTS / (end - begin);
    return (uint32_t)part;
}

static uint32_t bits_of(uint32_t bits) { return (uint32_t)__builtin_popcount(bits); }

static bool is_lost(const part_light *part, double share, double of_all)
{
    return part->all >= LEAST_LIGHT_OF_PART * of_all && part->lost > share * part->all &&
           bits_of(part->batches) >= AGREEING_BATCHES;
}

static void add(part_light *part, const ca_light_sample *sample, bool lost)
{
    part->all += sample->light;
    if (!lost) return;
    part->lost += sample->light;
    part->batches |= 1u << sample->batch;
}

bool ca_method_loses_light(const ca_light_sample *samples, size_t count, const ca_light_region *region)
{
    part_light picture = {0}, parts[PARTS][PARTS] = {0};
    double expected = 0.0;
    for (size_t i = 0; i < count; i++) {
        const ca_light_sample *s = &samples[i];
        expected += s->expected;
        add(&picture, s, expected < 1.0);
        add(&parts[part_along(s->y, region->y0, region->y1)][part_along(s->x, region->x0, region->x1)], s,
            expected < 1.0);
    }
    bool lost = is_lost(&picture, LOST_OF_PICTURE, picture.all);
    for (int p = 0; p < PARTS * PARTS && !lost; p++)
        lost = is_lost(&parts[p / PARTS][p % PARTS], LOST_OF_PART, picture.all);
    return lost;
}

double ca_method_dots(const ca_light_sample *samples, size_t count, const ca_dot_light *light)
{
    double sum = 0.0;
    for (size_t i = 0; i < count; i++) {
        const ca_light_sample *s = &samples[i];
        const double expected = s->expected + (light->light_paths - 1.0) * s->splats;
        if (s->shown || !(expected > 0.0)) continue;
        const double per_path = expected / light->expected_scale; /* Q / T */
        const double weight = light->weight(light->user, s->x, s->y), brings = s->light / per_path;
        const double value = brings / light->paths_of_pixel; /* of the pixel */
        const double over = 1.0 - light->square / (weight * value * value);
        if (over > 0.0) sum += over * weight * brings * s->light;
    }
    return sum / (light->camera_paths * light->paths_of_pixel);
}
