/* caustica.h: the C interface of libcaustica, a physically based renderer for light through glass and mirrors.
 *
 * Life of a picture:
 *
 *     ca_error error;
 *     ca_scene *scene = NULL;
 *     ca_render_settings settings;
 *     ca_image_layers *image = NULL;
 *     ca_render_settings_init(&settings);
 *     if (ca_scene_load("scene.xml", NULL, 0, &scene, &error) != CA_OK) { puts(error.message); ... }
 *     settings.samples_per_pixel = 64;
 *     ca_render(scene, &settings, &image, NULL, &error);
 *     ca_image_save(image, "scene.exr", 0.0f, &error);
 *     ca_image_release(image);
 *     ca_scene_release(scene);
 *
 * Units: linear Rec. 709 radiance, W sr^-1 m^-2 where the scene has units. Images have their first row on top.
 * Errors: every call that can fail returns a ca_status and writes one sentence to the ca_error it is given
 * (which may be NULL). Threads: a scene is immutable and may be rendered by several threads at once; one image,
 * one settings record and one error belong to one thread at a time. */
#ifndef CAUSTICA_H
#define CAUSTICA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define CA_VERSION_MAJOR 0
#define CA_VERSION_MINOR 1
#define CA_VERSION_PATCH 0

#if defined(__GNUC__)
#define CA_API __attribute__((visibility("default")))
#else
#define CA_API
#endif

/* Every way a call can end. */
#define CA_STATUS_LIST(X)                                                                                          \
    X(CA_OK, "ok")                                                                                                 \
    X(CA_ERROR_MEMORY, "out of memory")                                                                            \
    X(CA_ERROR_FILE, "a file cannot be read or written")                                                           \
    X(CA_ERROR_FORMAT, "a file is damaged or of an unknown format")                                                \
    X(CA_ERROR_SCENE, "the scene asks for something wrong or unknown")                                             \
    X(CA_ERROR_UNSUPPORTED, "the chosen method cannot do this")                                                    \
    X(CA_ERROR_ARGUMENT, "a setting is out of range")                                                              \
    X(CA_ERROR_INTERRUPTED, "ended before it was done, as was asked")                                              \
    X(CA_ERROR_THREADS, "the system gives no more threads")

typedef enum ca_status {
#define CA_STATUS_ENUM(name, text) name,
    CA_STATUS_LIST(CA_STATUS_ENUM)
#undef CA_STATUS_ENUM
} ca_status;

/* What went wrong, as one line for a person; starts with "file:line:column: " where a file is to blame. */
typedef struct ca_error {
    char message[1024];
} ca_error;

CA_API const char *ca_status_name(ca_status status);

/* "0.1.0" */
CA_API const char *ca_version(void);

/* ---- Scenes ---------------------------------------------------------------------------------------------------- */

typedef struct ca_scene ca_scene;

/* Replaces the value of a scene's <default name="..." value="..."/>. */
typedef struct ca_define {
    const char *name, *value;
} ca_define;

/* Reads a scene (Mitsuba 3 XML, .pbrt, .gltf, .glb) with its meshes and textures and makes it ready to render, with
 * its first sensor. `scene` is set on success. */
CA_API ca_status ca_scene_load(const char *path, const ca_define *defines, size_t define_count, ca_scene **scene,
                               ca_error *error);
CA_API void ca_scene_release(ca_scene *scene); /* NULL is allowed */

/* What the scene's text says and is read otherwise (a sampler of another name, a texture filter): one sentence each,
 * starting with "file:line:column: ". NULL behind the last. The text lives as long as the scene. */
CA_API const char *ca_scene_note(const ca_scene *scene, size_t index);

/* Scenes from memory: a text in the language of the scene files, and what is large as arrays that it names. All is
 * copied, and the caller's again when the call is over, but for arrays of meshes that are lent. */

/* What <shape type="mesh"><string name="data" value="NAME"/></shape> stands for, in its own space. */
typedef struct ca_mesh_data {
    const char *name;
    size_t vertex_count, triangle_count;
    const float *positions;  /* 3 a vertex */
    const float *normals;    /* 3 a vertex, of any length; NULL: smooth ones, unless face_normals is set */
    const float *uvs;        /* 2 a vertex, v upwards; NULL: none */
    const uint32_t *indices; /* 3 a triangle, each below vertex_count; counterclockwise seen from outside */
    /* Lends the arrays: they must stay as they are until it is called, once, in whichever thread, also on failure:
     * during the call already where nothing is used in place, else when the last scene is released that uses them
     * (the scene, its views, later versions that share the mesh). In place are used: indices, unless the shape flips
     * its normals or its to_world mirrors; uvs, unless they are flipped; positions where there is no to_world, unless
     * they end exactly where a page of memory ends. Normals are always copied. NULL: everything is. */
    void (*release)(void *user);
    void *release_user;
} ca_mesh_data;

/* What <string name="data" value="NAME"/> stands for in a bitmap texture or an envmap: linear values. */
typedef struct ca_bitmap_data {
    const char *name;
    uint32_t width, height, channels; /* 1 grey, 2 grey and alpha, 3 RGB, 4 RGB and alpha */
    const float *pixels;              /* width * height * channels, first row on top */
} ca_bitmap_data;

typedef struct ca_scene_source {
    const char *text; /* NULL: that of the file `path` */
    size_t size;
    const char *path; /* what messages call the text, and where its relative file names start; not NULL */
    const ca_define *defines;
    size_t define_count;
    const ca_mesh_data *meshes;
    size_t mesh_count;
    const ca_bitmap_data *bitmaps;
    size_t bitmap_count;
    uint32_t sensor;    /* of several sensors, counted from 0 */
    const int *stop;    /* another thread or a signal handler may set it to other than 0, by an atomic store: reading
                           and building end within half a second with CA_ERROR_INTERRUPTED. May be NULL */
    const ca_scene *previous; /* the version that was edited, may be NULL: ca_scene_parse */
    double memory_mib;  /* that reading may take, and 64 bytes more for each byte that is read; 0: 1024. Beyond it:
                           CA_ERROR_MEMORY */
    const char *camera; /* the id of the sensor (glTF: the name of its node) instead of its number; NULL: none */
} ca_scene_source;
#define CA_SCENE_MEMORY_MIB 1024.0

/* As ca_scene_load; CA_ERROR_ARGUMENT where there is no such sensor.
 *
 * Edits: a scene never changes; its next version is parsed from the edited source (text, definitions, arrays) with
 * `previous`, and is in every bit what it would be without. What is the same in both is shared instead of read,
 * copied and built again: meshes and pictures from files that did not change (path, size, times; but for those of
 * pbrt and glTF scenes, which are read again) and from arrays of the same content, and the structures that rays are
 * traced with, which are one for all shapes of the world, one for each shapegroup and one for all instances. So
 * editing a sensor, light, material or texture builds none of them, moving an instance only the last, and changing a
 * mesh in a shapegroup that group's and the last. The two versions may be released in any order, and renders of the
 * former go on. */
CA_API ca_status ca_scene_parse(const ca_scene_source *source, ca_scene **scene, ca_error *error);

/* How many structures for tracing rays were built for this scene, and not shared with the previous one: 0 where no
 * geometry was edited. */
CA_API uint32_t ca_scene_builds(const ca_scene *scene);

/* The same scene seen otherwise: the source's <sensor>, with its film and sampler, and its <integrator>, if it has
 * one, replace the scene's; there can be nothing else in it. Shapes, lights and materials are shared, nothing is
 * built again, and the two scenes may be released in any order. Threads: several may make views of one scene. */
CA_API ca_status ca_scene_view(ca_scene *scene, const ca_scene_source *source, ca_scene **view, ca_error *error);

/* Rays against the scene's shapes, for programs that build on the same geometry. Each call is one thread's; several
 * may ask at once. */
typedef struct ca_ray {
    float origin[3], direction[3]; /* of any length but 0 */
    float t_min, t_max;            /* hits lie between; in units of the direction's length */
} ca_ray;

typedef struct ca_ray_hit {
    float t; /* INFINITY: nothing was met, or the ray has a value that is not finite */
    float position[3];
    float normal[3], shading_normal[3]; /* unit; the first is the surface's own, on the side of the second */
    float uv[2]; /* 0 on spheres, disks and cylinders in scenes where no texture asks for it */
    uint32_t shape, primitive, instance; /* UINT32_MAX: there is none */
} ca_ray_hit;

/* The nearest hit of each ray. */
CA_API void ca_scene_intersect(const ca_scene *scene, const ca_ray *rays, size_t count, ca_ray_hit *hits);
/* Does each ray meet anything? */
CA_API void ca_scene_occluded(const ca_scene *scene, const ca_ray *rays, size_t count, bool *occluded);
/* The id that the scene's text gives a shape, borrowed; NULL where it has none or there is no such shape. */
CA_API const char *ca_scene_shape_id(const ca_scene *scene, uint32_t shape);
CA_API const char *ca_scene_instance_id(const ca_scene *scene, uint32_t instance); /* the same of an instance */

/* ---- Rendering ------------------------------------------------------------------------------------------------- */

struct ca_image_layers;
struct ca_render_statistics;
struct ca_ranks;

typedef struct ca_render_progress {
    uint32_t passes_done, passes_total; /* total 0: not known */
    bool blocks;                        /* what is counted are blocks of pairs */
    double seconds, seconds_total;      /* total 0: not limited by time */
    double seconds_predicted;           /* > 0: of the whole render, to its noise target */
    double noise_percent;               /* relative standard error of the image so far; negative: not known yet */
    double noise_target;                /* 0: none */
    uint32_t noise_passes;              /* passes done when noise_percent was estimated */
    double noise_seconds;               /* seconds then */
    const char *method;                 /* which method integrator `auto` has chosen, and why; NULL: none (yet) */
    /* Makes the picture so far, as the render would give it if it ended now. Only while the callback runs, and in its
     * thread; NULL: there is no picture yet, or no whole one. Costs nothing where it is not called. `statistics` may
     * be NULL. */
    ca_status (*snapshot)(const struct ca_render_progress *progress, struct ca_image_layers **image,
                          struct ca_render_statistics *statistics, ca_error *error);
    const char *checkpoint_failure; /* why the last checkpoint could not be written; NULL: it could */
    void *render; /* for `snapshot` */
    /* Of a render by several ranks, whose passes `snapshot` lacks until they have sent them: waits until they all
     * have, which takes up to a pass. NULL: it lacks none. Likewise only in the callback. */
    void (*gather)(const struct ca_render_progress *progress);
    /* Where `auto` chose a method whose light will be dots, as ca_preflight warns of a method that is named; NULL:
     * nothing of that is known. */
    const char *method_warning;
    double seconds_choosing; /* of `seconds`, before the first pass: for a method, and for numbers of rays */
} ca_render_progress;

/* What to render with. Make one with ca_render_settings_init; zero or NULL then means "as the scene says". */
typedef struct ca_render_settings {
    size_t size; /* of this structure, as the program knows it, so that later versions may have more fields; 0: what
                    it was in version 0.1 */
    /* "path" or "path:max_depth=5,rr_depth=3"; the scene's depth parameters stay. "auto": what leaves the least error
     * in the time, found by trials; it depends on how fast the machine is, the image only on what was chosen. */
    const char *integrator;
    uint32_t samples_per_pixel; /* camera paths per pixel; of `light`, light paths. Rounded up to whole passes, of
                                   which there are 16,777,215 at most */
    double seconds;             /* > 0: stop after the pass in which this much rendering time is reached */
    /* > 0: stop when the relative standard error of the image is below this many percent. A picture that is still
     * black after 2^24 samples (64 of a pixel at least, 4096 at most) is given up: its noise is not known. */
    double noise_percent;
    /* How many light paths, and camera paths of each pixel, of bdpm, ppm, bdpt, vcm, ovcm, vavcm, and of what `auto`
     * chooses; NULL: light_paths and camera_paths. "auto": what is estimated to give the least noise in the time (of
     * ppm the light paths alone, with one camera path; where paths connect one number of camera paths for all
     * pixels); the settings are then those of the pilot, samples_per_pixel is the mean over pixels, alpha is 0 and
     * the sampler `independent`, whatever the scene says (other settings are refused). Such an image depends on how
     * fast the machine is. Else the path of an .exr that such a render or `caustica noise` wrote: its numbers (layer
     * Rays.Numbers) instead of light_paths and camera_paths, which must not be set beside it; the image is the same
     * to the bit whatever the threads. Or the path of a .part, the checkpoint of a render with "auto": all that was
     * decided up to it is repeated, with the same settings, to the bits of the image that this render would have had
     * there; samples, time and noise must not be set beside it. See docs/papers/000.md, sections C and D. */
    const char *rays;
    const char *rays_objective; /* what "auto" makes small: variance in the "mean" (NULL), "relative", or of the
                                   "worst-decile" */
    const char *sampler; /* "independent", "halton", "halton-plain", "sobol", "sobol-plain", "sobol-image",
                            "sobol-tiles", "sobol-tiles-plain", "zsobol", "lattice", "lattice-plain",
                            "lattice-image", "lattice-tiles", "lattice-tiles-plain" */
    uint64_t seed;
    bool has_seed;
    /* > 0: render in so many replicates (>= 2) that are independent of each other, for the layers Confidence*.*:
     * groups of passes with the sampler `independent` (0: each pass is one), with the others a scrambling for each
     * (0: there are no such layers). Samples per pixel, given or the scene's, must come to a multiple of so many
     * passes. */
    uint32_t replicates;
    uint32_t threads;       /* at most; 0: one per processor. The image does not depend on it, to the bit */
    uint32_t width, height; /* of the full film; its crop is scaled along */
    bool has_crop;
    uint32_t crop[4]; /* x0, y0, x1, y1, half open, in pixels of the full film */
    int max_depth;    /* as Mitsuba: 1 sees lights only, -1 is unlimited */
    bool has_max_depth;
    /* Parameters of integrators that have them, for others an error. Like max_depth they win over the scene; one that
     * is also in `integrator` must have the same value there. */
    double radius; /* > 0: of merges, in the first pass */
    double alpha;  /* how fast it shrinks: r^2 = radius^2 / passes^alpha, in [0, 1] */
    bool has_alpha;
    uint32_t light_paths;  /* > 0: in a pass */
    uint32_t camera_paths; /* > 0: per pixel in a pass */
    /* > 0: for film and light paths. A film that needs more is refused; light paths are traced in parts if a pass
     * needs more for them. The image does not depend on it, to the bit (but for qmcppm's blocks=filled, which fill
     * it). 0: 2 GiB for the light paths of a pass, no limit for anything else, nor for qmcppm. */
    double memory_mib;
    /* Folder for one picture of what each technique found, s camera and t light vertices, before and after weighting:
     * hit_s3_t0_unweighted.exr, connect_s2_t2_weighted.exr, ..._weight.exr. Needs a max_depth of at most 13. */
    const char *strategies_directory;
    /* For integrators that render by blocks of pairs of camera and light paths (qmcppm), for others an error. Blocks
     * share their paths: such an image does not know its noise, and noise_percent is refused. */
    bool has_blocks;
    uint64_t blocks[2];    /* render these only, half open, counted from 0; instead of samples_per_pixel */
    /* Render these passes only, half open, counted from 0, instead of samples_per_pixel (with replicates, which that
     * number is divided by, whole groups of them). A pass is a function of scene, settings and its number. Refused
     * with noise_percent, with the integrator `auto` (but where `rays` is a picture, which names the method), and
     * with rays that are chosen or repeated. */
    bool has_passes;
    uint64_t passes[2];
    const char *part_path; /* also write the sums of the passes or blocks to this file, for ca_merge_parts */
    /* File in which a render is kept while it goes on (NULL: none), so that little is lost with it: after each so
     * many seconds (0: every 300 s, or 100 times what the last one took to write, if that is more), and at its end.
     * With `resume` the render goes on from the file where there is one, to the bits of a render without a break;
     * its samples, time, noise target, threads and memory may be others, all else must be the same (with replicates
     * the samples, too, and with blocks=filled the memory). Without `resume` the file must not exist. The file is
     * locked against other renders (PATH.lock). One that cannot be written is told by the progress callback; the
     * render goes on, and CA_ERROR_FILE is returned if the last one failed, but of a whole render with
     * `checkpoint_if_long`. With rays "auto", without ranks, the file has what was decided, too, and the bits
     * are those of `rays` with that file. Refused with strategies_directory. */
    const char *checkpoint_path;
    double checkpoint_seconds;
    bool checkpoint_if_long; /* only where the whole render is expected to take more than ten minutes */
    bool resume;
    /* Called after each pass or block; false ends the render, the image made so far is returned. The time it takes is
     * no rendering time. */
    bool (*progress)(const ca_render_progress *progress, void *user);
    void *progress_user;
    /* A number that another thread or a signal handler may set to other than 0, by an atomic store, and which then
     * stays so: work ends within half a second, in the middle of a pass or block, which then is no part of the
     * image. Making the image of the whole ones counts: two threads make one of a megapixel in that time, of more it
     * takes longer (see `discard`). Layers that the scene asks for (`aov`) have up to a second of their own, and are
     * left out where they take longer (`lacks_layers`). Where there was no whole pass or block yet, there is no
     * image: CA_ERROR_INTERRUPTED. NULL: passes are finished. */
    const int *stop;
    /* Other processes that make the same picture (render/ranks.h), for the program; NULL: none. All of them call
     * ca_render; it is rank 0 that reports, writes and has the image (the others get none). The image is the same,
     * to the bit. A pass or block is then finished, whatever `stop` says. With rays "auto" rank 0 chooses the
     * numbers once, by a pilot, before the first pass: such an image is, to the bit, the one that its own file makes
     * as `rays`, with alpha 0. Refused with a record of rays, and with
     * strategies_directory. */
    const struct ca_ranks *ranks;
    /* As `stop`, and mostly the same number: once it is set, nothing of what was made is wanted. The image is not
     * made then, nor are a part file and pictures of techniques, and the call ends within half a second whatever the
     * image's size: CA_ERROR_INTERRUPTED. A pass under way is ended by `stop` alone. NULL: the image is made. */
    const int *discard;
    /* Called with progress_user where another render has checkpoint_path, or left a file there, when this one locks
     * it: gives a name that is tried instead (the text of checkpoint_path may have become this name), and stays while
     * ca_render is at work. NULL, also as its answer: that is an error, as it is of a file that is gone on from. */
    const char *(*checkpoint_taken)(void *user);
} ca_render_settings;

#define ca_render_settings_init(settings) ca_render_settings_init_sized(settings, sizeof(ca_render_settings))
CA_API void ca_render_settings_init_sized(ca_render_settings *settings, size_t size);

/* Where samples that are not finite come from: the techniques hit, next event, connect, splat, merge; and those that
 * only the film noticed. */
enum { CA_NON_FINITE_SOURCES = 6 };

/* Of a render with numbers of rays of its own (ca_render_settings.rays); of "auto" also how they were chosen. */
typedef struct ca_rays_statistics {
    uint32_t light_paths; /* N_F in the end; 0: not such a render */
    double camera_paths;  /* N_B in the end, mean over pixels */
    uint32_t
        phases; /* in how many, each with numbers of its own, after the pilot; 0: not "auto", or ended in its pilot */
    double pilot_seconds;
    double predicted_gain; /* efficiency over the pilot's numbers, by the estimates it ended with; NAN: not known */
    /* Seconds of one processor: of an iteration without paths, a light path, a camera path, a candidate of merging;
     * NAN: not measured */
    double iteration_seconds, light_path_seconds, camera_path_seconds, candidate_seconds;
} ca_rays_statistics;

/* Of integrator `auto`: a method that was tried on a small picture of the scene. */
enum { CA_METHOD_TRIALS = 24, CA_METHOD_REASON_SIZE = 320 };

typedef struct ca_tried_method {
    const char *name; /* of the integrator, static */
    bool no_splats;   /* of bdpt */
    bool guided;      /* its light paths start where light reaches the picture */
    double light_paths; /* in a pass of the render; 0: it has none */
    uint32_t iterations; /* of the trial */
    /* Of an iteration, mean over pixels, over squared luminance: by the trial, with that of lights which the camera
     * sees at once or through mirrors and clear glass; of dots, by a pilot that knows them better. */
    double variance, dot_variance;
    double seconds; /* of one processor, that an iteration of the render is expected to take */
} ca_tried_method;

/* The method that was chosen. */
typedef struct ca_method_statistics {
    double seconds;                     /* that choosing took, of the render's; 0: nothing was tried */
    char reason[CA_METHOD_REASON_SIZE]; /* "": nothing was chosen. One sentence: which method, and why */
    uint32_t trial_count;
    ca_tried_method trials[CA_METHOD_TRIALS];
} ca_method_statistics;

/* Totals over a render. Make one with ca_render_statistics_init, or of zeros. */
typedef struct ca_render_statistics {
    size_t size;              /* set by the program, as that of ca_render_settings */
    double seconds;           /* of rendering, without loading */
    double samples_per_pixel; /* as the setting of that name counts them */
    uint64_t iterations; /* passes or blocks */
    uint64_t seed;       /* that was used: the setting's or the scene's */
    uint64_t light_paths, camera_paths;
    uint64_t rays, shadow_rays; /* nearest-hit and visibility queries */
    uint64_t photons, photons_tested, merges;
    uint64_t peak_memory_bytes; /* of the process */
    double mean_luminance;
    /* Standard deviation of one iteration's pixel luminance, averaged over pixels; NAN: not known. */
    double mean_standard_deviation;
    double noise_percent; /* root of the mean variance of a pixel's mean, over the mean luminance; < 0: not known */
    bool has_confidence;            /* there are error bars, the layers Confidence*.*; and of all pixels ... */
    double confidence_marked;       /* ... so many have some that say nothing, by luminance: a fraction; */
    double confidence_widened;      /* so many have some that are widened by what their neighbourhood tells */
    uint64_t non_finite;            /* samples that were not finite or negative: dropped, and a defect ... */
    uint64_t non_finite_from[CA_NON_FINITE_SOURCES]; /* ... by where they come from */
    bool interrupted;               /* ended by the progress callback */
    double first_predicted_seconds; /* of the whole render to its noise target, when that could first be said; 0:
                                       never */
    double first_predicted_at;      /* in which second that was */
    ca_rays_statistics numbers_of_rays;
    ca_method_statistics method;
    uint64_t blocks[2];             /* those rendered, half open; 0, 0: not by blocks */
    const char *const *notes; /* as ca_scene_note, `note_count` of them; they live as long as the scene */
    size_t note_count;
    uint64_t passes[2];             /* those rendered, half open; 0, 0: not by passes of one kind */
    uint64_t passes_resumed;        /* so many of these passes, or of the blocks, were in the checkpoint */
    uint32_t ranks;                 /* processes that made them */
    bool keeps_checkpoint;          /* the file of checkpoint_path is this render's: written by it or gone on from */
    bool lacks_layers;              /* the image is without those that the scene asks for (`aov`) */
} ca_render_statistics;

#define ca_render_statistics_init(statistics) \
    ca_render_statistics_init_sized(statistics, sizeof(ca_render_statistics))
CA_API void ca_render_statistics_init_sized(ca_render_statistics *statistics, size_t size);

/* A picture: named channels ("R", "Variance.G", "Albedo.B", ...), see docs/images.md. */
typedef struct ca_image_layers ca_image_layers;

/* Renders with `settings` (NULL: all as the scene says). `statistics` may be NULL. The image is the caller's, also on
 * failure: NULL then, unless the part file or the pictures of techniques could not be written (CA_ERROR_FILE), or
 * passes had been made before one failed for lack of memory or threads, or the scene's layers could not be made: the
 * image is then of what there is, and so are the statistics. */
CA_API ca_status ca_render(const ca_scene *scene, const ca_render_settings *settings, ca_image_layers **image,
                           ca_render_statistics *statistics, ca_error *error);

/* What can be said of a render before it is made. Shares are of the light of the whole image. */
enum { CA_PREFLIGHT_WARNINGS = 4, CA_PREFLIGHT_WARNING_SIZE = 256 };

typedef struct ca_preflight {
    bool no_light; /* the scene has none: the picture will be black */
    /* Light of which the integrator is expected to make less than one sample in the whole render, with a 95 %
     * interval: it will be missing, and the picture does not show that. Where numbers of rays are
     * chosen or come from a file, with the usual ones. NAN: not known (no light; integrators qmcppm and auto). */
    double lost_light, lost_light_low, lost_light_high;
    /* Light that the render finds by merging, and how many photons a pixel merges where that is, over the whole
     * render and on the average; with few the picture is dots. NAN: not known (as above, and where numbers of
     * rays are chosen or come from a file), or the method does not merge. */
    double merged_light, merged_light_low, merged_light_high;
    double merged_photons, merged_photons_low, merged_photons_high;
    double radius; /* of merges in the first pass: given, or the default, which a render with this setting need not
                      look for again; 0: the method does not merge, or none is chosen yet */
    uint64_t camera_paths, light_paths, rays, shadow_rays; /* of the pilot that told */
    uint32_t warning_count;
    char warnings[CA_PREFLIGHT_WARNINGS][CA_PREFLIGHT_WARNING_SIZE]; /* one sentence each */
} ca_preflight;

/* Checks the settings (NULL: all as the scene says) as ca_render would, and looks at the light of the scene with
 * 16,384 camera paths and 32,768 light paths on one thread: a function of the scene, the settings and the seed alone.
 * A render that ends by time or noise is taken for one of 2.5 million camera paths a second of each thread (0
 * threads: of each processor), and of an hour where no time is set. */
CA_API ca_status ca_preflight_make(const ca_scene *scene, const ca_render_settings *settings, ca_preflight *preflight,
                                   ca_error *error);

/* Adds up part files (ca_render_settings.part_path), all of passes or all of blocks, in any order. They must not
 * overlap, and all else that the image depends on must be the same; CA_ERROR_ARGUMENT tells which files do not fit,
 * and why. The result is the same, to the bit, as that of one render of all the passes or blocks. It goes to the
 * file `part_path`, if that is not NULL: blocks must follow each other without gap. It is developed into `image`, if
 * that is not NULL: an image needs all passes or blocks from 0. `statistics` may be NULL. Where the file cannot be
 * written the rest is made all the same, as ca_render does it. */
CA_API ca_status ca_merge_parts(const char *const *paths, size_t count, const char *part_path,
                                ca_image_layers **image, ca_render_statistics *statistics, ca_error *error);

/* ---- Noise ----------------------------------------------------------------------------------------------------- */

/* Where the noise of bidirectional photon mapping comes from, and what it would be with other numbers of paths
 * (Ershov, Birukov, Voloboy, Galaktionov 2020, "Calculation of Noise Components for Bidirectional Path Tracing with
 * Photon Maps"). The variance of a pixel's luminance in one iteration of N_F light paths and N_B camera paths per
 * pixel is
 *
 *     V = (C - L^2) / (N_F N_B) + (1 - 1/N_F) (B - L^2) / N_B + (1 - 1/N_B) (F - L^2) / N_F        (equation 6)
 *
 * with C, B, F, L that do not depend on N_F and N_B: the pair, camera and light terms. All are estimated without bias
 * from independent iterations, so that small ones may come out negative. */
typedef struct ca_noise ca_noise; /* a measurement: 208 bytes a pixel, 528 where paths connect */

/* Averages over pixels, of variances (W^2 sr^-2 m^-4 where the scene has units) and of their roots; roots of negative
 * variances count as 0. */
typedef struct ca_noise_summary {
    uint64_t pixels;
    double luminance;
    double predicted_rms, measured_rms, camera_rms, light_rms,
        pair_rms; /* of roots of V, of the sample variance, of the terms */
    double predicted, measured, camera, light, pair;                     /* of the same themselves */
    uint64_t negative_predicted, negative_measured, negative_camera, negative_light,
        negative_pair;           /* pixels below zero */
    double connect, connect_rms; /* of the term of connections, which may be below zero; 0 without them */
    uint64_t negative_connect;
} ca_noise_summary;

/* Measures in `iterations` (>= 2) iterations of `bdpm` or `ppm`. The settings are those of a render, but: where
 * neither they nor the scene name one of the two, it is bdpm; where neither sets them, there are 30,000 light paths
 * and 4 camera paths, 1 of ppm; light_paths must be 2 or more; the sampler is `independent`, as the law wants,
 * whatever the scene says; alpha is 0, whatever the scene says, unless they set it: with one radius all iterations
 * are distributed alike. What else ends a render (samples, seconds, noise), rays, replicates, blocks and strategies
 * are refused. The progress callback may end it early, but not before the second iteration. Where they name it, the
 * integrator may also be `bdpt`, `vcm`, `ovcm` or `vavcm`, with no more camera paths per pixel than light paths:
 * pair, camera and light term are then those of all that is not connected, and a fourth, `connect`, may be negative.
 * Their weights depend on the numbers of paths, so that predictions for others are of the weights measured with, but
 * for those of ca_noise_measure_for. `image` (may be NULL) is that of ca_render with the layers Noise.* of
 * docs/images.md; `statistics` may be NULL. On failure `noise` and `image` are NULL, unless two iterations had been
 * made before one failed for lack of threads or of memory (but for that of the pairs): they are the caller's then, of
 * what there is. */
CA_API ca_status ca_noise_measure(const ca_scene *scene, const ca_render_settings *settings, uint32_t iterations,
                                  ca_noise **noise, ca_image_layers **image, ca_render_statistics *statistics,
                                  ca_error *error);

/* Numbers of paths, N_F and N_B. */
typedef struct ca_noise_counts {
    uint32_t light_paths, camera_paths;
} ca_noise_counts;

/* The same. Where paths connect, all that they bring is also summed up with the weights that it has in iterations
 * with each of these numbers of paths (at least one, no more camera paths than light paths): predictions for these
 * are then right. Each takes 168 bytes a pixel, and a quarter of an iteration's time. Elsewhere weights contain no
 * numbers of paths, and nothing is added. */
CA_API ca_status ca_noise_measure_for(const ca_scene *scene, const ca_render_settings *settings, uint32_t iterations,
                                      const ca_noise_counts *counts, size_t count, ca_noise **noise,
                                      ca_image_layers **image, ca_render_statistics *statistics, ca_error *error);

/* What the law says for any numbers of paths, averaged over a region of the measured picture: x0, y0, x1, y1, half
 * open, in pixels of the full film; NULL: all of it. `measured` is the sample variance of the iterations that were
 * made, whatever the numbers here. CA_ERROR_ARGUMENT: a region that is empty or outside; a number of 0; camera_paths
 * > 1 after a measurement with one camera path, from which F cannot be estimated. */
CA_API ca_status ca_noise_average(const ca_noise *noise, const uint32_t *region, uint32_t light_paths,
                                  uint32_t camera_paths, ca_noise_summary *summary, ca_error *error);
CA_API void ca_noise_release(ca_noise *noise); /* NULL is allowed */

/* Seconds of one processor that paths take, without gathering pairs; with standard errors from the scatter among
 * tiles and passes. NAN: there were none. They change slowly with the number of light paths. */
typedef struct ca_noise_times {
    uint32_t light_paths; /* measured with half as many and with twice as many */
    double iteration, light_path; /* an iteration without paths; a light path, with sorting its photons */
    double camera_path;           /* without: */
    double candidate;             /* of merging: a photon in reach of a camera path whose merge is weighed */
    double iteration_error, light_path_error, camera_path_error, candidate_error;
    double segments_per_camera_path;
    double candidates_per_pair; /* of a light path with a camera path */
} ca_noise_times;

/* Numbers of paths of an iteration, and what is expected of it. Variance x seconds is what a fixed time leaves of the
 * variance. */
typedef struct ca_noise_numbers {
    uint32_t light_paths;
    double camera_paths; /* per pixel, mean over pixels */
    double variance;     /* what the objective says, W^2 sr^-2 m^-4; of `relative` without unit */
    double seconds;      /* of one processor */
} ca_noise_numbers;

typedef struct ca_noise_recommendation {
    ca_noise_numbers best;    /* with a map of camera paths */
    ca_noise_numbers uniform; /* the best with one number of camera paths for all pixels */
    ca_noise_numbers given;   /* those measured with */
    double gain_over_given, gain_over_uniform; /* of `best`: their variance x seconds over its own */
    uint32_t fewest_camera_paths, most_camera_paths; /* of the map */
    bool light_paths_only;     /* one camera path per pixel: of ppm, and where no more were measured */
    /* More are not recommended: 128 times those measured, 2^22, and where memory is limited what fits it at once */
    uint32_t most_light_paths;
    ca_noise_times times;
    bool interrupted; /* by the progress callback */
} ca_noise_recommendation;

/* The numbers of paths with the least noise after a given time, from a measurement (docs/papers/000.md, section D).
 * Traces a few iterations with the scene and settings of the measurement but half and twice the light paths, and
 * again with those that it recommends where they are far from that, to time them: a recommendation depends on the
 * machine, and a little on chance. Timing takes about a quarter of the time of the measurement, or two seconds. The
 * progress callback is asked before and while paths are timed; false ends that soon. Then, and where no noise was
 * found (a black image), nothing is recommended: CA_OK, but best.light_paths and all else is 0, and there is no map.
 * objective: the variance of the "mean" pixel (NULL), the "relative" one (over squared luminance), or that of the
 * "worst-decile". `image`, of the measurement, gets the map as layer Rays.Numbers and the light paths as attribute
 * caustica.lightPaths, for ca_render_settings.rays; NULL: the map is not kept. CA_ERROR_ARGUMENT: another objective;
 * settings that do not fit the measurement. Where paths connect, one number of camera paths is recommended for all
 * pixels, and light paths between those that were measured for (ca_noise_measure_for, with as many camera paths);
 * CA_ERROR_UNSUPPORTED: there are none, or the objective is that of the worst decile. */
CA_API ca_status ca_noise_recommend(const ca_noise *noise, const ca_scene *scene, const ca_render_settings *settings,
                                    const char *objective, ca_image_layers *image,
                                    ca_noise_recommendation *recommendation, ca_error *error);

/* ---- Images ---------------------------------------------------------------------------------------------------- */

/* Size of the picture (the rendered part). */
CA_API void ca_image_size(const ca_image_layers *image, uint32_t *width, uint32_t *height);
/* width * height values of one channel, first row on top, borrowed; NULL where there is no such channel. */
CA_API const float *ca_image_channel(const ca_image_layers *image, const char *name);
/* How many channels there are, and the name of each, borrowed; NULL past the last. */
CA_API size_t ca_image_channel_count(const ca_image_layers *image);
CA_API const char *ca_image_channel_name(const ca_image_layers *image, size_t index);
/* What is said of the picture, such as "caustica.integrator": name and value, borrowed; `text` is NULL where the
 * value is a number. False past the last. */
CA_API bool ca_image_attribute(const ca_image_layers *image, size_t index, const char **name, const char **text,
                               double *number);
/* A picture of black without channels, and its channels one by one: width * height values, which are copied. */
CA_API ca_status ca_image_make(uint32_t width, uint32_t height, ca_image_layers **image, ca_error *error);
CA_API ca_status ca_image_add(ca_image_layers *image, const char *name, const float *values, ca_error *error);
/* All channels of an EXR file; R G B, and A where there is one, of PFM, HDR, PNG, JPEG, TGA, BMP, PNM and WebP files
 * (8 bit values are made linear). */
CA_API ca_status ca_image_load(const char *path, ca_image_layers **image, ca_error *error);

/* How much a picture differs from another one, over the pixels that are finite in both (docs/metrics.md). */
typedef struct ca_image_difference {
    double rmse, mae, relmse, smape; /* over R, G and B */
    double ssim, flip_ldr, flip_hdr; /* NAN: the picture is too small; the reference is black */
    double mean_luminance, reference_mean_luminance;
    uint64_t pixels, non_finite;
    /* Blocks of 16 x 16 pixels whose means are tested against each other where both pictures, or the one and an exact
     * reference, carry their variance: 5 % is the chance of one rejected block or more where nothing but noise
     * differs. */
    uint32_t blocks, blocks_rejected;
    double p_value, detectable_bias; /* NAN: no block could be tested */
} ca_image_difference;

/* Errors: CA_ERROR_ARGUMENT (sizes or places that differ, no R G B), CA_ERROR_MEMORY. */
CA_API ca_status ca_image_compare(const ca_image_layers *image, const ca_image_layers *reference,
                                  ca_image_difference *difference, ca_error *error);
/* Within a region, x0, y0, x1, y1, half open, in pixels of the pictures (NULL: all of them; CA_ERROR_ARGUMENT: it is
 * empty or reaches outside), until *stop is set as in ca_render_settings (NULL: never): CA_ERROR_INTERRUPTED
 * soon after. */
CA_API ca_status ca_image_compare_within(const ca_image_layers *image, const ca_image_layers *reference,
                                         const uint32_t *region, const int *stop, ca_image_difference *difference,
                                         ca_error *error);

/* .exr (all channels), .png (sRGB, times 2^exposure), .pfm; complete or not at all. */
CA_API ca_status ca_image_save(const ca_image_layers *image, const char *path, float exposure, ca_error *error);
/* ca_image_load and ca_image_save until *stop is set: CA_ERROR_INTERRUPTED soon after, and there is no image, or the
 * file is as before. */
CA_API ca_status ca_image_load_until(const char *path, const int *stop, ca_image_layers **image, ca_error *error);
CA_API ca_status ca_image_save_until(const ca_image_layers *image, const char *path, float exposure, const int *stop,
                                     ca_error *error);
CA_API void ca_image_release(ca_image_layers *image); /* NULL is allowed */

#ifdef __cplusplus
}
#endif

#endif
