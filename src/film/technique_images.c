#include "film/technique_images.h"

#include "base/memory.h"
#include "image/layers.h"
#include "math/numeric.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

typedef struct technique_pixel {
    ca_rgb unweighted, weighted;
} technique_pixel;

enum { SIDE = CA_TECHNIQUE_MAX_VERTICES + 1, PICTURES = CA_TECHNIQUE_COUNT * SIDE * SIDE };

struct ca_technique_images {
    uint32_t x0, y0, width, height;
    technique_pixel *pictures[PICTURES]; /* NULL until something was found; set once, by the first thread */
    technique_pixel *kept[PICTURES];     /* copies; NULL: black */
    bool failed;                         /* out of memory: reported when the pictures are written */
};

ca_status ca_technique_images_create(ca_technique_images **images, const uint32_t crop[4], ca_error *error)
{
    *images = ca_alloc_zeroed(1, sizeof **images);
    if (!*images) return ca_fail_memory(error, "the technique images");
    (*images)->x0 = crop[0];
    (*images)->y0 = crop[1];
    (*images)->width = crop[2] - crop[0];
    (*images)->height = crop[3] - crop[1];
    return CA_OK;
}

void ca_technique_images_destroy(ca_technique_images *images)
{
    if (!images) return;
    for (uint32_t i = 0; i < PICTURES; i++) {
        ca_free(images->pictures[i]);
        ca_free(images->kept[i]);
    }
    ca_free(images);
}

static uint32_t picture_index(ca_technique technique, uint32_t s, uint32_t t)
{
    return ((uint32_t)technique * SIDE + s) * SIDE + t;
}

/* The picture, made if it is the first time; NULL when out of memory. */
static technique_pixel *picture(ca_technique_images *images, uint32_t index)
{
    technique_pixel *known = __atomic_load_n(&images->pictures[index], __ATOMIC_ACQUIRE);
    if (known) return known;
    technique_pixel *made = ca_alloc_zeroed((size_t)images->width * images->height, sizeof *made);
    if (!made) {
        __atomic_store_n(&images->failed, true, __ATOMIC_RELAXED);
        return NULL;
    }
    if (__atomic_compare_exchange_n(&images->pictures[index], &known, made, false, __ATOMIC_ACQ_REL,
                                    __ATOMIC_ACQUIRE))
        return made;
    ca_free(made);
    return known;
}

void ca_technique_images_add(ca_technique_images *images, ca_technique technique, uint32_t s, uint32_t t, uint32_t x,
                             uint32_t y, ca_rgb unweighted, float weight)
{
    assert(technique < CA_TECHNIQUE_COUNT && s < SIDE && t < SIDE);
    technique_pixel *pixels = picture(images, picture_index(technique, s, t));
    if (!pixels) return;
    technique_pixel *pixel = &pixels[(size_t)(y - images->y0) * images->width + (x - images->x0)];
    pixel->unweighted = ca_rgb_add(pixel->unweighted, unweighted);
    pixel->weighted = ca_rgb_madd(pixel->weighted, weight, unweighted);
}

void ca_technique_images_keep(ca_technique_images *images)
{
    const size_t pixels = (size_t)images->width * images->height;
    for (uint32_t i = 0; i < PICTURES; i++) {
        if (!images->pictures[i]) continue;
        if (!images->kept[i]) images->kept[i] = ca_alloc(pixels, sizeof *images->kept[i]);
        if (!images->kept[i])
            images->failed = true;
        else
            memcpy(images->kept[i], images->pictures[i], pixels * sizeof *images->kept[i]);
    }
}

void ca_technique_images_restore(ca_technique_images *images)
{
    const size_t pixels = (size_t)images->width * images->height;
    for (uint32_t i = 0; i < PICTURES; i++) {
        if (!images->pictures[i]) continue;
        if (images->kept[i])
            memcpy(images->pictures[i], images->kept[i], pixels * sizeof *images->kept[i]);
        else
            memset(images->pictures[i], 0, pixels * sizeof *images->pictures[i]);
    }
}

void ca_technique_images_size(const ca_technique_images *images, uint32_t *width, uint32_t *height)
{
    *width = images->width;
    *height = images->height;
}

bool ca_technique_images_get(const ca_technique_images *images, ca_technique technique, uint32_t s, uint32_t t,
                             size_t pixel, ca_rgb *unweighted, ca_rgb *weighted)
{
    const technique_pixel *pixels = images->pictures[picture_index(technique, s, t)];
    if (!pixels) return false;
    *unweighted = pixels[pixel].unweighted;
    *weighted = pixels[pixel].weighted;
    return true;
}

/* ---- Files ----------------------------------------------------------------------------------------------------- */

typedef enum picture_kind { UNWEIGHTED, WEIGHTED, WEIGHT, KIND_COUNT } picture_kind;

static ca_rgb pixel_value(const technique_pixel *pixel, picture_kind kind, float inverse_passes)
{
    if (kind == UNWEIGHTED) return ca_rgb_scale(pixel->unweighted, inverse_passes);
    if (kind == WEIGHTED) return ca_rgb_scale(pixel->weighted, inverse_passes);
    const float found = ca_luminance(pixel->unweighted);
    return ca_rgb_grey(found != 0.0f ? ca_luminance(pixel->weighted) / found : 0.0f);
}

static ca_status fill_layers(const ca_technique_images *images, const technique_pixel *pixels, picture_kind kind,
                             float inverse_passes, ca_image_layers *layers, ca_error *error)
{
    static const char *const names[3] = {"R", "G", "B"};
    float *channels[3];
    for (int c = 0; c < 3; c++) CA_TRY(ca_layers_add(layers, names[c], &channels[c], error));
    for (size_t i = 0; i < (size_t)images->width * images->height; i++) {
        const ca_rgb value = pixel_value(&pixels[i], kind, inverse_passes);
        channels[0][i] = value.r;
        channels[1][i] = value.g;
        channels[2][i] = value.b;
    }
    return CA_OK;
}

static ca_status write_picture(const ca_technique_images *images, const technique_pixel *pixels, picture_kind kind,
                               uint32_t passes, const char *path, ca_error *error)
{
    ca_image_layers *layers = NULL;
    CA_TRY(ca_layers_create(&layers, images->width, images->height, error));
    layers->x0 = (int32_t)images->x0;
    layers->y0 = (int32_t)images->y0;
    layers->full_width = images->x0 + images->width;
    layers->full_height = images->y0 + images->height;
    ca_status status = fill_layers(images, pixels, kind, 1.0f / (float)passes, layers, error);
    if (status == CA_OK) status = ca_layers_write(layers, path, 0.0f, error);
    ca_layers_destroy(layers);
    return status;
}

bool ca_technique_images_file(uint32_t index, char name[CA_TECHNIQUE_FILE_SIZE])
{
    static const char *const kinds[KIND_COUNT] = {"unweighted", "weighted", "weight"};
    const uint32_t picture = index / KIND_COUNT;
    if (picture >= PICTURES) return false;
    snprintf(name, CA_TECHNIQUE_FILE_SIZE, "%s_s%u_t%u_%s.exr",
             ca_technique_name((ca_technique)(picture / (SIDE * SIDE))), picture / SIDE % SIDE, picture % SIDE,
             kinds[index % KIND_COUNT]);
    return true;
}

/* Of one technique with one number of vertices on each side. One that fails does not keep the others from being
 * written; the first is told. */
static ca_status write_kinds(const ca_technique_images *images, uint32_t index, uint32_t passes,
                             const char *directory, ca_error *error)
{
    const technique_pixel *pixels = images->pictures[index];
    ca_status status = CA_OK;
    if (!pixels) return CA_OK;
    for (uint32_t kind = 0; kind < KIND_COUNT; kind++) {
        char name[CA_TECHNIQUE_FILE_SIZE], path[4096];
        ca_technique_images_file(index * KIND_COUNT + kind, name);
        const int length = snprintf(path, sizeof path, "%s/%s", directory, name);
        if (length < 0 || (size_t)length >= sizeof path)
            return ca_fail(error, CA_ERROR_FILE, NULL, "%.200s...: the folder's name is too long", directory);
        const ca_status written =
            write_picture(images, pixels, (picture_kind)kind, passes, path, status == CA_OK ? error : NULL);
        if (status == CA_OK) status = written;
    }
    return status;
}

ca_status ca_technique_images_write(const ca_technique_images *images, uint32_t passes, const char *directory,
                                    ca_error *error)
{
    if (images->failed) return ca_fail_memory(error, "the technique images");
    if (mkdir(directory, 0777) != 0 && errno != EEXIST)
        return ca_fail(error, CA_ERROR_FILE, NULL, "%s: cannot make the folder: %s", directory, strerror(errno));
    ca_status status = CA_OK;
    for (uint32_t i = 0; i < PICTURES; i++) {
        const ca_status written = write_kinds(images, i, passes, directory, status == CA_OK ? error : NULL);
        if (status == CA_OK) status = written;
    }
    return status;
}
