#include "path/light_record.h"

#include <math.h>
#include <string.h>

/* ---- Layout ---------------------------------------------------------------------------------------------------- */

/* Which weights ask for what: reuse.c. */
static void set_wishes(ca_light_layout *layout, const ca_reuse_rules *reuse, bool observed)
{
    const bool density = reuse->kind == CA_REUSE_DENSITY || reuse->kind == CA_REUSE_NORMALISED;
    layout->footprints = observed || reuse->kind == CA_REUSE_FOOTPRINT;
    layout->starts = layout->footprints || reuse->kind == CA_REUSE_CORRELATION;
    layout->tilts = observed || (layout->footprints && reuse->projected);
    layout->photon_densities = observed || density;
    layout->projected = reuse->projected;
    layout->points = observed;
}

ca_light_layout ca_light_layout_of(const ca_mis_rules *rules, uint32_t shapes, bool pairs, bool observed)
{
    ca_light_layout layout = {.connects = rules->connect,
                              .wide_shapes = rules->connect && shapes > 1 << CA_LIGHT_SHAPE_BITS,
                              .pairs = pairs,
                              .sums = rules->photon_sums,
                              .classes = rules->factors};
    set_wishes(&layout, &rules->reuse, observed);
    const uint32_t points = layout.points ? CA_LIGHT_POINT_WORDS : 0;
    layout.start_words = 2 + 2 * (uint32_t)layout.starts + layout.classes + points;
    layout.event_words = 1 + (uint32_t)layout.footprints + layout.tilts;
    layout.vertex_words = layout.event_words + 2 + 2 * (uint32_t)layout.footprints + layout.photon_densities + points;
    layout.record_words = (uint32_t)(sizeof(ca_light_record) / sizeof(float)) + layout.connects +
                          layout.wide_shapes + layout.pairs + (layout.sums ? CA_LIGHT_SUMS_WORDS : 0);
    return layout;
}

/* ---- Packing --------------------------------------------------------------------------------------------------- */

ca_light_source ca_light_source_of(const ca_light_layout *layout, const ca_path_vertex *densities,
                                   const ca_light_vertex *vertices, uint32_t count, uint32_t path)
{
    ca_light_source source = {.densities = densities, .vertices = vertices, .count = count, .path = path};
    while (source.count > 1 && !vertices[source.count - 1].capable) source.count--;
    for (uint32_t i = 1; i < source.count; i++) {
        source.records += vertices[i].capable;
        source.places += layout->connects && vertices[i].capable && !vertices[i].matte;
    }
    return source;
}

/* A number that is not negative carries a flag in its sign. */
static inline float flagged(float number, bool flag) { return flag ? -number : number; }

static float *put_point(const ca_light_layout *layout, const ca_surface_point *point, float *to)
{
    if (!layout->points) return to;
    memcpy(to, point, sizeof *point);
    return to + CA_LIGHT_POINT_WORDS;
}

static void pack_start(const ca_light_layout *layout, const ca_path_vertex *v, const ca_surface_point *point,
                       float *to)
{
    *to++ = flagged(v->pdf_forward.v, v->at_infinity);
    *to++ = v->next_event_ratio;
    if (layout->starts) {
        *to++ = v->light_choice;
        *to++ = v->sqrt_area;
    }
    if (layout->classes) memcpy(to++, &v->light_class, sizeof *to);
    put_point(layout, point, to);
}

/* What the event at a vertex tells, of the vertex before, too. */
static void pack_event(const ca_light_layout *layout, const ca_path_vertex *v, float *to)
{
    *to++ = (v - 1)->pdf_reverse.v;
    if (layout->footprints) *to++ = v->spread_reverse;
    if (layout->tilts) *to = v->cos_ratio;
}

/* What is known when a vertex is met. */
static void pack_arrival(const ca_light_layout *layout, const ca_path_vertex *v, const ca_surface_point *point,
                         float *to)
{
    *to++ = flagged(v->pdf_forward.v, v->connectable);
    *to++ = v->to_previous;
    if (layout->footprints) {
        *to++ = v->distance;
        *to++ = v->sqrt_omega;
    }
    if (layout->photon_densities) *to++ = v->photon_density;
    put_point(layout, point, to);
}

static void pack_record(const ca_light_layout *layout, const ca_light_vertex *v, uint32_t index, uint32_t rank,
                        uint32_t path, float *to)
{
    const ca_light_record record = {.wi = v->wi,
                                    .throughput = v->throughput,
                                    .ng = v->point.ng,
                                    .position = v->point.position,
                                    .index = index & 0x3ff,
                                    .rank = rank & 0x3ff,
                                    .shape = v->point.shape & ((1u << CA_LIGHT_SHAPE_BITS) - 1),
                                    .passes = v->passes};
    memcpy(to, &record, sizeof record);
    to += sizeof record / sizeof *to;
    if (layout->connects) *to++ = v->point.position_error;
    if (layout->wide_shapes) memcpy(to++, &v->point.shape, sizeof *to);
    if (layout->sums) {
        memcpy(to, &v->sums, sizeof v->sums);
        to += CA_LIGHT_SUMS_WORDS;
    }
    if (layout->pairs) memcpy(to, &path, sizeof *to);
}

static void pack_place(const ca_surface_point *point, float *to)
{
    to[0] = point->barycentric.x;
    to[1] = point->barycentric.y;
    memcpy(&to[2], &point->primitive, sizeof *to);
    memcpy(&to[3], &point->instance, sizeof *to);
}

void ca_light_pack(const ca_light_layout *layout, const ca_light_source *source, float *at)
{
    const ca_light_vertex *vertices = source->vertices;
    float *densities = at - layout->start_words, *record = at;
    float *place = at + (size_t)source->records * layout->record_words;
    uint32_t rank = 0;
    pack_start(layout, source->densities, &vertices[0].point, densities);
    for (uint32_t i = 1; i < source->count; i++) {
        densities -= layout->vertex_words;
        pack_arrival(layout, &source->densities[i], &vertices[i].point, densities + layout->event_words);
        if (i + 1 < source->count) pack_event(layout, &source->densities[i], densities);
        if (!vertices[i].capable) continue;
        pack_record(layout, &vertices[i], i, rank++, source->path, record);
        record += layout->record_words;
        if (!layout->connects || vertices[i].matte) continue;
        pack_place(&vertices[i].point, place);
        place += CA_LIGHT_PLACE_WORDS;
    }
}

/* ---- Unpacking ------------------------------------------------------------------------------------------------- */

static inline void unpack_start(const ca_light_layout *layout, const float *from, ca_path_vertex *v)
{
    *v = (ca_path_vertex){.pdf_forward = {fabsf(from[0])},
                          .next_event_ratio = from[1],
                          .light_choice = layout->starts ? from[2] : 0.0f,
                          .sqrt_area = layout->starts ? from[3] : 0.0f,
                          .cos_ratio = 1.0f,
                          .at_infinity = signbit(from[0]) != 0};
    if (layout->classes) memcpy(&v->light_class, from + (layout->starts ? 4 : 2), sizeof v->light_class);
}

/* Everything below that is inlined is so for a loop of its own for every layout that matters. */
#define CA_UNPACK static inline __attribute__((always_inline)) void

CA_UNPACK unpack_arrival(const ca_light_layout *layout, const float *from, float area, ca_path_vertex *v)
{
    const uint16_t connectable = signbit(from[0]) != 0;
    v->pdf_forward.v = fabsf(from[0]);
    v->pdf_reverse.v = 0.0f;
    v->to_previous = from[1];
    v->distance = layout->footprints ? from[2] : 0.0f;
    v->sqrt_omega = layout->footprints ? from[3] : 0.0f;
    v->sqrt_area = layout->footprints ? area + v->distance * v->sqrt_omega : 0.0f;
    v->photon_density = layout->photon_densities ? from[layout->footprints ? 4 : 2] : 0.0f;
    v->spread_reverse = 0.0f;
    v->cos_ratio = 1.0f;
    v->connectable = connectable;
    v->connectable_count = (uint16_t)((v - 1)->connectable_count + connectable);
}

CA_UNPACK unpack_event(const ca_light_layout *layout, const float *from, ca_path_vertex *v)
{
    (v - 1)->pdf_reverse.v = from[0];
    if (layout->footprints) v->spread_reverse = from[1];
    if (layout->tilts) v->cos_ratio = from[2];
}

/* Of the vertices behind v[0]. */
CA_UNPACK unpack_vertices(ca_light_layout layout, const float *from, uint32_t count, ca_path_vertex *v)
{
    const ca_path_vertex *last = v + count - 1;
    for (v++;; v++) {
        const float area = layout.projected ? (v - 1)->sqrt_area * sqrtf((v - 1)->cos_ratio) : (v - 1)->sqrt_area;
        from -= layout.vertex_words;
        unpack_arrival(&layout, from + layout.event_words, area, v);
        if (v == last) return;
        unpack_event(&layout, from, v);
    }
}

/* The common layouts are known when this is compiled. */
void ca_light_unpack(const ca_light_layout *layout, const float *at, uint32_t count, ca_path_vertex *densities)
{
    const ca_light_layout plain = {.vertex_words = 3, .event_words = 1};
    const ca_light_layout footprints = {.vertex_words = 6, .event_words = 2, .footprints = true};
    const float *from = at - layout->start_words;
    unpack_start(layout, from, densities);
    if (layout->vertex_words == plain.vertex_words)
        unpack_vertices(plain, from, count, densities);
    else if (layout->vertex_words == footprints.vertex_words)
        unpack_vertices(footprints, from, count, densities);
    else
        unpack_vertices(*layout, from, count, densities);
}

void ca_light_unpack_points(const ca_light_layout *layout, const float *at, uint32_t count, ca_light_vertex *vertices)
{
    const float *end = at;
    for (uint32_t i = 0; i < count; i++) {
        memcpy(&vertices[i].point, end - CA_LIGHT_POINT_WORDS, sizeof vertices[i].point);
        end -= i == 0 ? layout->start_words : layout->vertex_words;
    }
}

bool ca_light_met_dirac(const ca_light_layout *layout, const float *at, uint32_t last)
{
    const float *from = at - layout->start_words;
    for (uint32_t i = 1; i <= last; i++) {
        from -= layout->vertex_words;
        if (!signbit(from[layout->event_words])) return true;
    }
    return false;
}

ca_surface_point ca_light_record_point(const ca_light_layout *layout, const ca_light_record *record,
                                       const float *place)
{
    ca_surface_point point = {.ng = record->ng,
                              .position = record->position,
                              .position_error = ca_light_record_error(record),
                              .shape = ca_light_record_shape(layout, record)};
    if (!place) return point;
    point.barycentric = (ca_vec2){place[0], place[1]};
    memcpy(&point.primitive, &place[2], sizeof point.primitive);
    memcpy(&point.instance, &place[3], sizeof point.instance);
    return point;
}
