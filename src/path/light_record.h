/* A light path as it lies in memory: a block of words of four bytes, in which every vertex takes what the algorithm
 * asks for (ca_light_layout) and no more.
 *
 *     densities of v[n-1] ... v[1] | start: v[0] || record 0 | record 1 | ... | places that are not matte
 *                                                ^ the path's number
 *
 * Records are of the vertices that can scatter smoothly: photons, which may be merged with and connected to. The
 * other vertices, and v[0], have densities only. Densities grow downwards from the path's number, so that a record's
 * index and rank tell where those of its path are. What follows from the rest is not kept: numbers of connectable
 * vertices and footprints' areas are made again, by the operations that made them, so that every bit is the same.
 * Nor is what nobody asks for: vertices behind the last record, and what the event at the last vertex tells.
 *
 * State, in bytes:
 *
 *     start      8   densities; 8 more for footprints and the correlation rule: light choice and area; 4 for factors
 *     densities 12   + 12 for footprints, + 4 where they follow the tilt, + 4 for densities of photons; of the last
 *                    vertex 4 less, 8 less with footprints, 12 where they follow the tilt
 *     record    52   + 4 for connections, + 4 for these in scenes of more than 2048 shapes, + 4 for pairs,
 *                    + 12 for a photon's sums
 *     place     16   of a record that is not matte (scene/matte.h), for connections
 *
 * so 68 a matte vertex of `vcm` and 80 of `ovcm`. For an observer there are more (ca_light_layout.points). */
#ifndef CA_PATH_LIGHT_RECORD_H
#define CA_PATH_LIGHT_RECORD_H

#include "geometry/surface_point.h"
#include "math/rgb.h"
#include "path/mis.h"

/* A vertex of a light path while it is traced, but for its densities; v[0] has only its point, whose shape is the
 * light's number in the scene. */
typedef struct ca_light_vertex {
    ca_vec3 wi;        /* unit, towards the previous vertex */
    ca_rgb throughput; /* flux that arrives, W, before scattering here */
    ca_photon_sums sums; /* where the layout has them */
    bool capable;      /* its surface can scatter smoothly: it has a record */
    bool matte;        /* its shape is (scene/matte.h) */
    bool passes;       /* likewise */
    ca_surface_point point;
} ca_light_vertex;

enum { CA_LIGHT_SHAPE_BITS = 11 };

/* What merges read comes first. */
typedef struct ca_light_record {
    ca_vec3 wi;          /* as ca_light_vertex; likewise: */
    ca_rgb throughput;
    ca_vec3 ng, position;
    uint32_t index : 10; /* the vertex' number in the path */
    uint32_t rank : 10;  /* records of the path before it */
    uint32_t shape : CA_LIGHT_SHAPE_BITS; /* where connections want it and it fits */
    uint32_t passes : 1; /* its shape lets light through (scene/matte.h) */
} ca_light_record;

_Static_assert(sizeof(ca_light_record) == 52, "light_record.h promises 52 bytes");
_Static_assert(CA_PATH_MAX_VERTICES <= 1 << 10, "a vertex' number fits its record");

/* What is kept, and how many words it takes. */
typedef struct ca_light_layout {
    bool connects;         /* error bounds, shapes, and places that are not matte */
    bool wide_shapes;      /* in a word of their own */
    bool pairs;            /* the path's number in its chunk */
    bool sums;             /* ca_photon_sums */
    bool starts;           /* light choice and area of v[0] */
    bool classes;          /* of its light */
    bool footprints;       /* spreads and distances */
    bool tilts;            /* ratios of cosines */
    bool photon_densities;
    bool points;           /* whole points of all vertices, for an observer, who sees all of the above, too */
    bool projected;        /* as ca_reuse_rules */
    uint32_t start_words, vertex_words, record_words;
    uint32_t event_words; /* of a vertex', those that its event tells */
} ca_light_layout;

enum {
    CA_LIGHT_PLACE_WORDS = 4,
    CA_LIGHT_POINT_WORDS = sizeof(ca_surface_point) / sizeof(float),
    CA_LIGHT_START_MOST = 5 + CA_LIGHT_POINT_WORDS,
    CA_LIGHT_VERTEX_MOST = 8 + CA_LIGHT_POINT_WORDS,
    CA_LIGHT_SUMS_WORDS = sizeof(ca_photon_sums) / sizeof(float),
    CA_LIGHT_RECORD_MOST = sizeof(ca_light_record) / sizeof(float) + 3 + CA_LIGHT_SUMS_WORDS,
    /* Words of a path at most. */
    CA_LIGHT_PATH_MOST =
        CA_LIGHT_START_MOST +
        (CA_PATH_MAX_VERTICES - 1) * (CA_LIGHT_VERTEX_MOST + CA_LIGHT_RECORD_MOST + CA_LIGHT_PLACE_WORDS)
};

/* What an algorithm of these rules wants of a scene with so many shapes. */
ca_light_layout ca_light_layout_of(const ca_mis_rules *rules, uint32_t shapes, bool pairs, bool observed);

/* A path that is to be kept. */
typedef struct ca_light_source {
    const ca_path_vertex *densities;
    const ca_light_vertex *vertices;
    uint32_t count; /* vertices up to the last record; 1: there is none, and nothing to keep */
    uint32_t records, places;
    uint32_t path; /* its number in the chunk */
} ca_light_source;

ca_light_source ca_light_source_of(const ca_light_layout *layout, const ca_path_vertex *densities,
                                   const ca_light_vertex *vertices, uint32_t count, uint32_t path);

/* Words before and from the path's number on, of count >= 2 vertices. */
static inline uint32_t ca_light_words_before(const ca_light_layout *layout, uint32_t count)
{
    return layout->start_words + (count - 1) * layout->vertex_words - layout->event_words;
}

static inline uint32_t ca_light_words_behind(const ca_light_layout *layout, uint32_t records, uint32_t places)
{
    return records * layout->record_words + places * CA_LIGHT_PLACE_WORDS;
}

/* Writes it around `at`, where its number points to. */
void ca_light_pack(const ca_light_layout *layout, const ca_light_source *source, float *at);

/* The densities of the path's first `count` vertices, >= 2, as joins at the last of them want them: what its own
 * event tells is zero, also of the vertex before, and so is what the layout leaves out. */
void ca_light_unpack(const ca_light_layout *layout, const float *at, uint32_t count, ca_path_vertex *densities);
/* For an observer: their points. */
void ca_light_unpack_points(const ca_light_layout *layout, const float *at, uint32_t count,
                            ca_light_vertex *vertices);
/* Was there a Dirac event at one of v[1] ... v[last]? last < the number of vertices. */
bool ca_light_met_dirac(const ca_light_layout *layout, const float *at, uint32_t last);

/* Where the path's number points to, from one of its records. */
static inline const float *ca_light_record_start(const ca_light_layout *layout, const ca_light_record *record)
{
    return (const float *)(const void *)record - (size_t)record->rank * layout->record_words;
}

/* The path's number in its chunk; for pairs. */
static inline uint32_t ca_light_record_path(const ca_light_layout *layout, const ca_light_record *record)
{
    return ((const uint32_t *)(const void *)record)[layout->record_words - 1];
}

/* Where the layout has them. */
static inline const ca_photon_sums *ca_light_record_sums(const ca_light_layout *layout, const ca_light_record *record)
{
    const float *behind = (const float *)(const void *)(record + 1);
    return (const ca_photon_sums *)(const void *)(behind + layout->connects + layout->wide_shapes);
}

/* For connections: the record's shape, and its whole point; `place`: of those that are not matte the record's, else
 * NULL. */
static inline uint32_t ca_light_record_shape(const ca_light_layout *layout, const ca_light_record *record)
{
    return layout->wide_shapes ? ((const uint32_t *)(const void *)(record + 1))[1] : record->shape;
}

static inline float ca_light_record_error(const ca_light_record *record)
{
    return *(const float *)(const void *)(record + 1);
}

ca_surface_point ca_light_record_point(const ca_light_layout *layout, const ca_light_record *record,
                                       const float *place);

#endif
