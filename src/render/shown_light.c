#include "render/shown_light.h"

#include "base/memory.h"
#include "base/stop.h"
#include "math/lanes.h"
#include "render/method_trial.h"
#include "sampling/owen.h"

#include <math.h>

/* Squares of the picture; camera paths of a pixel of one: a highlight of a pixel's size is met, whichever it is. */
enum { SIDE = 32, LEAST_PATHS = 4, MOST_PATHS = 64, GROUP = 128 };

/* Set apart from the render's and the trials'. */
#define PILOT_SEED UINT64_C(0x73686f776e)

/* What a film position shows. */
typedef struct shown_point {
    float x, y, luminance;
} shown_point;

typedef struct shown_sums {
    double weight, light, square;
} shown_sums;

typedef struct shown_run {
    const ca_render_plan *plan;
    const ca_integrator_input *input;
    const void *integrator;
    ca_worker *worker;
    uint32_t paths, margin; /* of a pixel; pixels around a square from which its filters get light */
    shown_point *points;    /* owned; of a square; likewise: */
    shown_sums sums[SIDE * SIDE];
    ca_shown_light *shown;
} shown_run;

/* Of the full film, half open. */
typedef struct square {
    uint32_t x0, y0, x1, y1;
} square;

/* ---- Camera paths ---------------------------------------------------------------------------------------------- */

static uint32_t less(uint32_t at, uint32_t margin) { return at > margin ? at - margin : 0; }

/* With the pixels around it, as far as there is a film. */
static square widened(const shown_run *r, square s)
{
    const ca_camera *camera = &r->plan->camera;
    return (square){less(s.x0, r->margin), less(s.y0, r->margin), ca_min_u32(s.x1 + r->margin, camera->width),
                    ca_min_u32(s.y1 + r->margin, camera->height)};
}

/* Where on the film the path begins, as its integrator has it. */
static shown_point point_of(const shown_run *r, const ca_camera_path *path)
{
    const ca_sampler *sampler = r->input->sampler;
    const ca_stream stream = ca_stream_start(sampler, (uint64_t)path->y * sampler->width + path->x, path->index);
    float weight;
    const ca_vec2 offset = ca_filter_sample(r->input->filter, ca_sample_2d(&stream, CA_DIM_FILM), &weight);
    return (shown_point){(float)path->x + 0.5f + offset.x, (float)path->y + 0.5f + offset.y, path->shown};
}

static void trace_group(shown_run *r, square s, size_t first, uint32_t count)
{
    ca_film_sample samples[GROUP];
    ca_camera_path paths[GROUP];
    const uint32_t width = s.x1 - s.x0;
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t pixel = (uint32_t)((first + i) / r->paths);
        samples[i] = (ca_film_sample){0};
        paths[i] = (ca_camera_path){.x = s.x0 + pixel % width,
                                    .y = s.y0 + pixel / width,
                                    .index = (uint32_t)((first + i) % r->paths),
                                    .sample = &samples[i]};
    }
    ca_integrator_ppm.camera_paths(r->integrator, paths, count, 0, r->worker);
    for (uint32_t i = 0; i < count; i++) r->points[first + i] = point_of(r, &paths[i]);
}

/* ---- Pixels ---------------------------------------------------------------------------------------------------- */

/* The pixels from *first to before *end whose filters reach the position, within [low, high). */
static void reached(float position, float radius, uint32_t low, uint32_t high, uint32_t *first, uint32_t *end)
{
    const float from = ceilf(position - radius - 0.5f), to = floorf(position + radius - 0.5f);
    *first = from > (float)low ? (uint32_t)from : low;
    *end = to < (float)high - 1.0f ? (uint32_t)ca_max(to + 1.0f, 0.0f) : high;
}

static void add_point(shown_run *r, square s, const shown_point *point)
{
    const ca_filter *filter = &r->plan->filter;
    uint32_t x0, x1, y0, y1;
    reached(point->x, filter->radius, s.x0, s.x1, &x0, &x1);
    reached(point->y, filter->radius, s.y0, s.y1, &y0, &y1);
    if (x0 >= x1) return;
    _Alignas(32) float across[SIDE + CA_LANES];
    ca_filter_eval_run(filter, point->x - ((float)x0 + 0.5f), x1 - x0, across);
    const double light = (double)point->luminance;
    for (uint32_t y = y0; y < y1; y++) {
        const double down = fabs((double)ca_filter_eval(filter, point->y - ((float)y + 0.5f)));
        shown_sums *row = &r->sums[(size_t)(y - s.y0) * SIDE];
        for (uint32_t x = x0; x < x1; x++) {
            const double density = down * fabs((double)across[x - x0]);
            row[x - s.x0].weight += density;
            row[x - s.x0].light += density * light;
            row[x - s.x0].square += density * light * light;
        }
    }
}

static ca_status keep_pixels(const shown_run *r, square s, ca_error *error)
{
    ca_shown_light *shown = r->shown;
    for (uint32_t y = s.y0; y < s.y1; y++)
        for (uint32_t x = s.x0; x < s.x1; x++) {
            const shown_sums *sums = &r->sums[(size_t)(y - s.y0) * SIDE + (x - s.x0)];
            if (!(sums->square > 0.0)) continue;
            ca_shown_pixel *pixels = ca_array_grow(shown->pixels, &shown->capacity, shown->count + 1, sizeof *pixels);
            if (!pixels) return ca_fail_memory(error, "the pilot of visible lights");
            shown->pixels = pixels;
            pixels[shown->count++] = (ca_shown_pixel){
                .x = x, .y = y, .mean = sums->light / sums->weight, .square = sums->square / sums->weight};
        }
    return CA_OK;
}

/* Where no path sees a light, no pixel does. */
static ca_status look_at(shown_run *r, square s, ca_error *error)
{
    const square all = widened(r, s);
    const size_t count = (size_t)(all.x1 - all.x0) * (all.y1 - all.y0) * r->paths;
    bool any = false;
    for (size_t first = 0; first < count; first += GROUP) {
        CA_TRY(ca_stop_check(r->input->stop, error));
        trace_group(r, all, first, count - first < GROUP ? (uint32_t)(count - first) : GROUP);
    }
    r->shown->looked_at += (double)(s.x1 - s.x0) * (s.y1 - s.y0);
    for (size_t i = 0; i < count; i++) any = any || r->points[i].luminance > 0.0f;
    if (!any) return CA_OK;
    for (uint32_t i = 0; i < SIDE * SIDE; i++) r->sums[i] = (shown_sums){0};
    for (size_t i = 0; i < count; i++) add_point(r, s, &r->points[i]);
    return keep_pixels(r, s, error);
}

/* ---- Squares --------------------------------------------------------------------------------------------------- */

static square square_at(const uint32_t crop[4], uint32_t number)
{
    const uint32_t columns = (crop[2] - crop[0] + SIDE - 1) / SIDE;
    const uint32_t x = crop[0] + number % columns * SIDE, y = crop[1] + number / columns * SIDE;
    return (square){x, y, ca_min_u32(x + SIDE, crop[2]), ca_min_u32(y + SIDE, crop[3])};
}

/* So many squares of all, each anywhere in its one of as many strips. */
static ca_status look_at_some(shown_run *r, uint32_t some, uint32_t all, ca_error *error)
{
    for (uint32_t i = 0; i < some; i++) {
        const float u = some == all ? 0.5f : ca_unit_float(ca_pcg_permute(r->input->sampler->seed + i), 40);
        const uint32_t number = (uint32_t)(((double)i + (double)u) / some * all);
        CA_TRY(look_at(r, square_at(r->plan->crop, number), error));
    }
    return CA_OK;
}

static ca_status look(shown_run *r, double camera_paths, ca_error *error)
{
    const uint32_t *crop = r->plan->crop;
    const uint32_t columns = (crop[2] - crop[0] + SIDE - 1) / SIDE, rows = (crop[3] - crop[1] + SIDE - 1) / SIDE;
    const double pixels = ca_render_plan_pixels(r->plan), of_pixel = camera_paths / pixels;
    r->margin = (uint32_t)ceilf(ca_max(r->plan->filter.radius - 0.5f, 0.0f));
    r->paths = (uint32_t)fmin(fmax(floor(of_pixel), LEAST_PATHS), MOST_PATHS);
    const size_t side = SIDE + 2 * (size_t)r->margin;
    r->points = ca_alloc(side * side * r->paths, sizeof *r->points);
    if (!r->points) return ca_fail_memory(error, "the pilot of visible lights");
    const uint32_t all = columns * rows;
    const double some = fmin(1.0, of_pixel / LEAST_PATHS) * all;
    const ca_status status = look_at_some(r, ca_max_u32(1, (uint32_t)some), all, error);
    ca_free(r->points);
    return status;
}

/* ---- The pilot ------------------------------------------------------------------------------------------------- */

/* Camera paths of `ppm`, which end at the first vertex that photons are merged at; there is one light path, of which
 * nothing is looked at. */
static ca_status configure(const ca_render_plan *plan, ca_integrator_input *input, ca_error *error)
{
    const ca_integrator_type *ppm = &ca_integrator_ppm;
    const ca_method method = {.type = ppm, .unguided = true};
    CA_TRY(ca_method_configure(&method, plan, NULL, input, error));
    CA_TRY(ca_integrator_limit_pilot(ppm, ppm, input, input, error));
    CA_TRY(ca_integrator_set_number(ppm, "light_paths", 1.0, input, error));
    CA_TRY(ca_integrator_set_number(ppm, "alpha", 0.0, input, error));
    return ca_integrator_set_number(ppm, "radius", 1e-6 * (double)plan->scene->radius, input, error);
}

static ca_status trace(shown_run *r, ca_integrator_input *input, double camera_paths, ca_error *error)
{
    const ca_parallel parallel = {.workers = 1, .stop = input->stop};
    ca_worker worker = {.index = 0};
    void *state;
    CA_TRY(ca_integrator_ppm.create(input, &state, error));
    r->integrator = state;
    r->worker = &worker;
    ca_status status = ca_integrator_ppm.begin_round(state, 0, 0, &parallel, &worker, error);
    if (status == CA_OK) status = look(r, camera_paths, error);
    ca_integrator_ppm.destroy(state);
    return status;
}

ca_status ca_shown_light_find(ca_shown_light *shown, const ca_render_plan *plan, double camera_paths, ca_error *error)
{
    ca_sampler sampler = {.kind = CA_SAMPLER_INDEPENDENT, .seed = ca_pcg_permute(plan->seed ^ PILOT_SEED)};
    ca_sampler_prepare(&sampler, plan->camera.width, plan->camera.height);
    ca_filter filter = ca_filter_default(CA_RFILTER_BOX);
    ca_filter_prepare(&filter);
    ca_integrator_input input;
    *shown = (ca_shown_light){0};
    CA_TRY(configure(plan, &input, error));
    input.sampler = &sampler;
    input.filter = &filter;
    input.tells_shown = true;
    input.workers = 1;
    input.memory_bytes = 0.0;
    shown_run *r = ca_alloc_zeroed(1, sizeof *r);
    if (!r) return ca_fail_memory(error, "the pilot of visible lights");
    r->plan = plan, r->input = &input, r->shown = shown;
    const ca_status status = trace(r, &input, camera_paths, error);
    ca_free(r);
    if (status != CA_OK) ca_shown_light_destroy(shown);
    return status;
}

void ca_shown_light_destroy(ca_shown_light *shown)
{
    ca_free(shown->pixels);
    *shown = (ca_shown_light){0};
}

double ca_shown_light_variance(const ca_shown_light *shown, const ca_shown_scale *scale)
{
    double sum = 0.0;
    for (size_t i = 0; i < shown->count; i++) {
        const ca_shown_pixel *p = &shown->pixels[i];
        const double light = p->mean + scale->luminance(scale->user, p->x, p->y);
        sum += fmax(0.0, p->square - p->mean * p->mean) / (light * light + scale->least_square);
    }
    return shown->looked_at > 0.0 ? sum / (shown->looked_at * scale->paths_of_pixel) : 0.0;
}
