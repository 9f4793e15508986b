/* caustica compare: how much images differ from a reference, and whether noise explains it. */
#define _POSIX_C_SOURCE 200809L
#include "base/file.h"
#include "base/memory.h"
#include "base/processors.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/compare_maps.h"
#include "cli/compare_page.h"
#include "cli/outputs.h"
#include "cli/say.h"
#include "cli/shared_options.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

typedef struct compare_options {
    const char *reference, *stats, *maps, *tone, *flip, *flip_tone, *html, *html_layers;
    uint32_t roi[4], block;
    bool has_roi, resample, help;
    ca_rect_list masks;
    ca_metric_settings metrics;
    bool flip_auto; /* which FLIP is computed depends on the files */
    ca_places places;
} compare_options;

#define AT(field) .offset = offsetof(compare_options, field)
#define GIVEN(field) .given = offsetof(compare_options, field)

static const ca_option options[] = {
    {.name = "reference",
     .letter = 'r',
     .argument = "FILE",
     .kind = CA_OPTION_TEXT,
     AT(reference),
     .help = "what to compare with (needed)"},
    {.name = "roi",
     .argument = "x0,y0,x1,y1",
     .kind = CA_OPTION_RECT,
     AT(roi),
     GIVEN(has_roi),
     .help = "look at this part only: pixels, half open (default: all)"},
    CA_MASK_OPTION(AT(masks)),
    {.name = "maps",
     .argument = "FILE.exr",
     .kind = CA_OPTION_TEXT,
     AT(maps),
     .help = "write each metric as a layer; of several images into FILE-NAME.exr"},
    CA_STATS_OPTION("the numbers", AT(stats)),
    {.name = "html",
     .argument = "FILE.html",
     .kind = CA_OPTION_TEXT,
     AT(html),
     .help = "write a page that shows the images beside the reference (docs/report.md)"},
    {.name = "html-layers",
     .argument = "NAME,...",
     .kind = CA_OPTION_TEXT,
     AT(html_layers),
     .help = "layers that the page has beside R G B, \"all\" for all (default: none)"},
    {.name = "block",
     .argument = "N",
     .kind = CA_OPTION_COUNT,
     .minimum = 1,
     AT(block),
     .help = "side of the blocks that are tested (default: 16)"},
    {.name = "resample-reference",
     .kind = CA_OPTION_FLAG,
     AT(resample),
     .help = "average a reference that is a whole number of times larger"},
    {.name = "tone",
     .argument = "CURVE",
     .kind = CA_OPTION_TEXT,
     AT(tone),
     .help = "of SSIM and FLIP LDR: srgb (default), aces, hable, reinhard, linear"},
    {.name = "exposure",
     .argument = "STOPS",
     .kind = CA_OPTION_REAL,
     AT(metrics.exposure),
     .help = "of SSIM and FLIP LDR: pictures times 2^STOPS (default: 0)"},
    {.name = "ssim-window",
     .argument = "N",
     .kind = CA_OPTION_COUNT,
     .minimum = 1,
     AT(metrics.ssim.window),
     .help = "side of SSIM's window, odd (default: 11)"},
    {.name = "ssim-sigma",
     .argument = "PIXELS",
     .kind = CA_OPTION_POSITIVE,
     AT(metrics.ssim.sigma),
     .help = "of its Gaussian (default: 1.5)"},
    {.name = "ssim-range",
     .argument = "L",
     .kind = CA_OPTION_POSITIVE,
     AT(metrics.ssim.range),
     .help = "dynamic range of the values under the tone curve (default: 1)"},
    {.name = "ssim-k1", .argument = "K1", .kind = CA_OPTION_POSITIVE, AT(metrics.ssim.k1), .help = "(default: 0.01)"},
    {.name = "ssim-k2", .argument = "K2", .kind = CA_OPTION_POSITIVE, AT(metrics.ssim.k2), .help = "(default: 0.03)"},
    {.name = "flip",
     .argument = "KIND",
     .kind = CA_OPTION_TEXT,
     AT(flip),
     .help = "ldr, hdr, both or none (default: both; ldr with 8 and 16 bit files)"},
    {.name = "flip-ppd",
     .argument = "N",
     .kind = CA_OPTION_POSITIVE,
     AT(metrics.pixels_per_degree),
     .help = "pixels per degree (default: 67.02: 3840 pixels on 0.7 m, seen from 0.7 m)"},
    {.name = "flip-tone",
     .argument = "CURVE",
     .kind = CA_OPTION_TEXT,
     AT(flip_tone),
     .help = "of FLIP HDR: aces (default), hable, reinhard, srgb"},
    {.name = "flip-start",
     .argument = "STOPS",
     .kind = CA_OPTION_REAL,
     AT(metrics.flip_exposures.start),
     .help = "first exposure of FLIP HDR (default: from the reference's maximum)"},
    {.name = "flip-stop",
     .argument = "STOPS",
     .kind = CA_OPTION_REAL,
     AT(metrics.flip_exposures.stop),
     .help = "last exposure (default: from the reference's median)"},
    {.name = "flip-exposures",
     .argument = "N",
     .kind = CA_OPTION_COUNT,
     .minimum = 1,
     AT(metrics.flip_exposures.count),
     .help = "how many (default: one a stop, at least 2)"},
    CA_THREADS_OPTION("; the numbers do not depend on it", AT(metrics.threads)),
    CA_HELP_OPTION(AT(help)),
};
static const ca_option_table table = {"compare", options, sizeof options / sizeof options[0]};

static int print_help(void)
{
    printf("caustica compare IMAGE... --reference FILE [options]: measure how images differ from a reference\n\n");
    ca_options_print(&table, stdout);
    printf("\n");
    ca_options_print_prose(
        "Prints RMSE, MAE, relMSE, SMAPE, SSIM and FLIP (docs/metrics.md), the mean luminances, the median "
        "over blocks of the relative difference of block means and, where the image has the layers Variance.*"
        " and Samples.Y, how many blocks differ by more than noise explains (5 % false alarms for the whole "
        "picture).\n"
        "A difference is no failure: the exit status is 0 when the images could be compared.\n"
        "Example: caustica compare a.exr b.exr --reference ref.exr --mask 100,0,156,20 --maps maps.exr\n",
        stdout);
    return CA_EXIT_DONE;
}

/* ---- Settings -------------------------------------------------------------------------------------------------- */

static compare_options defaults(void)
{
    compare_options o = {.metrics = ca_metric_defaults()};
    o.metrics.threads = ca_processors();
    return o;
}

static const struct {
    const char *name;
    bool ldr, hdr;
} flip_kinds[] = {{"ldr", true, false}, {"hdr", false, true}, {"both", true, true}, {"none", false, false}};
enum { FLIP_KINDS = sizeof flip_kinds / sizeof flip_kinds[0] };

const char *ca_compare_flip_kind(size_t i) { return i < FLIP_KINDS ? flip_kinds[i].name : NULL; }

static ca_status find_flip_kind(compare_options *o, ca_error *error)
{
    o->flip_auto = !o->flip;
    for (size_t i = 0; o->flip && i < FLIP_KINDS; i++)
        if (strcmp(o->flip, flip_kinds[i].name) == 0) {
            o->metrics.flip_ldr = flip_kinds[i].ldr;
            o->metrics.flip_hdr = flip_kinds[i].hdr;
            return CA_OK;
        }
    if (!o->flip) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--flip: \"%.100s\" is not one of ldr, hdr, both, none", o->flip);
}

static ca_status find_tones(compare_options *o, ca_error *error)
{
    ca_error reason = {""};
    if (o->tone && ca_tone_find(o->tone, &o->metrics.tone, &reason) != CA_OK)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--tone: %.900s", reason.message);
    if (o->flip_tone && ca_tone_find(o->flip_tone, &o->metrics.flip_tone, &reason) != CA_OK)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--flip-tone: %.900s", reason.message);
    if (o->metrics.flip_tone == CA_TONE_LINEAR)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "--flip-tone: no exposure can be chosen for linear; take srgb");
    return CA_OK;
}

/* Beyond, any float is shown black or white. NAN: not given. */
static ca_status check_stops(const char *option, double stops, ca_error *error)
{
    const double most = 300.0;
    if (isnan(stops) || fabs(stops) <= most) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%s: %g is not from %g to %g", option, stops, -most, most);
}

static ca_status check_numbers(const ca_metric_settings *m, ca_error *error)
{
    if (m->ssim.window % 2 == 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--ssim-window: %u is not odd", m->ssim.window);
    if (m->pixels_per_degree < CA_FLIP_MIN_PIXELS_PER_DEGREE || m->pixels_per_degree > CA_FLIP_MAX_PIXELS_PER_DEGREE)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--flip-ppd: %g is not from %g to %g", m->pixels_per_degree,
                       CA_FLIP_MIN_PIXELS_PER_DEGREE, CA_FLIP_MAX_PIXELS_PER_DEGREE);
    CA_TRY(check_stops("--exposure", m->exposure, error));
    CA_TRY(check_stops("--flip-start", m->flip_exposures.start, error));
    CA_TRY(check_stops("--flip-stop", m->flip_exposures.stop, error));
    if (m->flip_exposures.start > m->flip_exposures.stop)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--flip-start %g is after --flip-stop %g",
                       m->flip_exposures.start, m->flip_exposures.stop);
    if (m->threads > 1024)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%u threads are over the limit of 1024", m->threads);
    return CA_OK;
}

static ca_status check(compare_options *o, const ca_text_list *images, ca_error *error)
{
    if (!o->reference) return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "option --reference is missing");
    if (images->count == 0) return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "an image to compare is missing");
    CA_TRY(find_flip_kind(o, error));
    CA_TRY(find_tones(o, error));
    CA_TRY(check_numbers(&o->metrics, error));
    if (o->html_layers && !o->html)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--html-layers needs --html: it says what the page shows");
    CA_TRY(ca_places_read(&o->places, o->reference, "which is to be compared", error));
    for (size_t i = 0; i < images->count; i++)
        CA_TRY(ca_places_read(&o->places, images->items[i], "which is to be compared", error));
    if (o->html) CA_TRY(ca_compare_check_output("--html", o->html, &o->places, error));
    return o->stats ? ca_compare_check_output("--stats", o->stats, &o->places, error) : CA_OK;
}

/* ---- Printing -------------------------------------------------------------------------------------------------- */

static void print_test(const ca_compared_image *image)
{
    const ca_block_test *test = &image->comparison.test;
    if (!test->done) {
        printf("  block test          not done: %s\n", test->blocks_untested
                                                           ? "each block has a pixel of unknown variance"
                                                           : "the image lacks Variance.* or Samples.Y");
        return;
    }
    printf("  blocks that differ  %u of %u (p = %.3g for the whole picture)\n", test->rejected, test->blocks,
           test->p_value);
    if (test->blocks_with_noise && isinf(test->detectable_bias))
        printf("  would detect        light where the reference is black, as it is in a typical block (%u of %u "
               "blocks have noise)\n",
               test->blocks_with_noise, test->blocks);
    else if (test->blocks_with_noise)
        printf("  would detect        a bias of %.3g %% in a typical block (5 %% significance, 80 %% power; %u of %u "
               "blocks have noise)\n",
               100.0 * test->detectable_bias, test->blocks_with_noise, test->blocks);
    else
        printf("  would detect        all that is more than rounding: no block has noise\n");
    if (test->blocks_untested)
        printf("  not tested          %u %s of unknown variance\n", test->blocks_untested,
               ca_noun(test->blocks_untested, "block", "blocks"));
    if (test->reference_exact)
        printf("  note                the reference tells no variance: taken as exact\n");
    else if (image->same_seed)
        printf("  note                both have the seed %.0f: the test takes their noise to be independent, which "
               "that of the same random numbers is not\n",
               image->seed);
}

static void print_perceived(const ca_metric_settings *settings, const ca_image_metrics *m)
{
    if (isnan(m->ssim))
        printf("  SSIM                not done: no window fits into the picture around a pixel that counts\n");
    else
        printf("  SSIM                %.6g\n", m->ssim);
    if (settings->flip_ldr) printf("  FLIP LDR            %.6g\n", m->flip_ldr);
    if (settings->flip_hdr && m->exposures.count > 0)
        printf("  FLIP HDR            %.6g (%u %s from %.4g to %.4g stops)\n", m->flip_hdr, m->exposures.count,
               ca_noun(m->exposures.count, "exposure", "exposures"), m->exposures.start, m->exposures.stop);
    else if (settings->flip_hdr)
        printf("  FLIP HDR            not done: half of the reference is black; give --flip-start and --flip-stop\n");
}

static void print_image(const ca_metric_settings *settings, const ca_compared_image *image)
{
    const ca_comparison *c = &image->comparison;
    ca_say(stdout, "%s\n", image->path);
    printf("  RMSE                %.6g\n", c->rmse);
    printf("  MAE                 %.6g\n", c->mae);
    printf("  relMSE              %.6g\n", c->relmse);
    printf("  SMAPE               %.6g\n", c->smape);
    print_perceived(settings, &image->metrics);
    printf("  mean luminance      %.6g, of the reference %.6g", c->mean_luminance, c->reference_mean_luminance);
    if (c->reference_mean_luminance != 0.0)
        printf(" (%+.3f %%)", 100.0 * (c->mean_luminance / c->reference_mean_luminance - 1.0));
    printf("\n");
    if (c->blocks > 0)
        printf("  block means         %.3f %% apart (median of %u %s)\n", 100.0 * c->median_block_difference,
               c->blocks, ca_noun(c->blocks, "block", "blocks"));
    print_test(image);
    if (c->masked || c->blocks_left_out)
        printf("  left out            %llu %s by masks, %u %s for it\n", (unsigned long long)c->masked,
               ca_noun((double)c->masked, "pixel", "pixels"), c->blocks_left_out,
               ca_noun(c->blocks_left_out, "block", "blocks"));
}

/* ---- Comparing ------------------------------------------------------------------------------------------------- */

/* By how much the reference is larger, the same in both directions; 0 where that is no whole number. */
static uint32_t size_ratio(const ca_image_layers *reference, const ca_image_layers *image)
{
    const uint32_t ratio = reference->width / image->width;
    const bool exact = ratio > 0 && (uint64_t)ratio * image->width == reference->width &&
                       (uint64_t)ratio * image->height == reference->height;
    return exact ? ratio : 0;
}

/* What a comparison works with and for. */
typedef struct comparing {
    const compare_options *options;
    const ca_image_layers *reference;
    ca_metric_settings metrics; /* for this image */
    const ca_compare_settings *region;
    const char *map_path;       /* NULL: no maps */
    ca_compare_page *page;      /* NULL: no page (any more) */
    /* Of what could not be written: it does not keep the rest from being measured and written (ca_output_note). */
    ca_status written;
    ca_error *failure;
} comparing;

/* A page that lacks an image is no page of this comparison. */
static void add_to_page(comparing *c, const ca_compared_image *result, const ca_image_layers *image,
                        const ca_image_layers *reference, const ca_image_layers *maps)
{
    ca_error reason = {""};
    const ca_status status = ca_compare_page_add(c->page, result, image, reference, maps, &reason);
    if (status == CA_OK) return;
    ca_output_note(&c->written, c->failure, status, &reason);
    c->page = NULL;
}

static ca_status compare_with(comparing *c, const ca_image_layers *image, const ca_image_layers *reference,
                              ca_compared_image *result, ca_image_layers **maps, ca_error *error)
{
    CA_TRY(ca_compare(image, reference, c->region, &result->comparison, error));
    CA_TRY(ca_measure_image(image, reference, c->region, &c->metrics, &result->metrics, maps, error));
    if (c->page) add_to_page(c, result, image, reference, *maps);
    return CA_OK;
}

static ca_status compare_resampled(comparing *c, const ca_image_layers *image, ca_compared_image *result,
                                   ca_image_layers **maps, ca_error *error)
{
    const ca_image_layers *reference = c->reference;
    const uint32_t ratio = c->options->resample ? size_ratio(reference, image) : 1;
    if (ratio == 1) return compare_with(c, image, reference, result, maps, error);
    if (ratio == 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "the reference's %u x %u pixels are no multiple of the image's %u x %u", reference->width,
                       reference->height, image->width, image->height);
    ca_image_layers *small = NULL;
    CA_TRY(ca_compare_downsample(reference, ratio, &small, error));
    const ca_status status = compare_with(c, image, small, result, maps, error);
    ca_layers_destroy(small);
    return status;
}

/* Files of whole numbers hold what a display shows, nothing brighter. */
static bool is_display_file(const char *path)
{
    static const char *const extensions[] = {".png", ".jpg", ".jpeg", ".tga", ".bmp",
                                             ".ppm", ".pgm", ".pnm",  ".webp"};
    for (size_t i = 0; i < sizeof extensions / sizeof extensions[0]; i++)
        if (strcasecmp(ca_path_extension(path), extensions[i]) == 0) return true;
    return false;
}

static void compare_seeds(const ca_image_layers *image, const ca_image_layers *reference, ca_compared_image *result)
{
    const ca_attribute *a = ca_layers_attribute(image, "caustica.seed");
    const ca_attribute *b = ca_layers_attribute(reference, "caustica.seed");
    result->same_seed = a && b && a->number == b->number;
    result->seed = a ? a->number : 0.0;
}

static void write_maps(comparing *c, const ca_compared_image *image, ca_image_layers *maps)
{
    ca_error reason = {""};
    const ca_status status =
        ca_compare_write_maps(c->map_path, c->options->reference, image, &c->metrics, maps, &reason);
    if (status == CA_OK) ca_say(stdout, "  wrote               %s\n", c->map_path);
    ca_output_note(&c->written, c->failure, status, &reason);
}

/* What is wrong with a picture is a failure, not wrong usage: the words were right. */
static ca_status compare_file(comparing *c, ca_compared_image *image, ca_error *error)
{
    c->metrics = c->options->metrics;
    if (c->options->flip_auto && (is_display_file(image->path) || is_display_file(c->options->reference)))
        c->metrics.flip_hdr = false;
    image->flip_is_hdr = c->metrics.flip_hdr;
    ca_image_layers *layers = NULL, *maps = NULL;
    CA_TRY(ca_layers_read(image->path, &layers, error));
    ca_error reason = {""};
    ca_status status = compare_resampled(c, layers, image, c->map_path || c->page ? &maps : NULL, &reason);
    compare_seeds(layers, c->reference, image);
    ca_layers_destroy(layers);
    if (status != CA_OK) ca_layers_destroy(maps);
    if (status != CA_OK)
        return ca_fail(error, status == CA_ERROR_ARGUMENT ? CA_ERROR_UNSUPPORTED : status, NULL, "%s: %.900s",
                       image->path, reason.message);
    print_image(&c->metrics, image);
    if (c->map_path) write_maps(c, image, maps);
    ca_layers_destroy(maps);
    return CA_OK;
}

static void warn(const ca_compared_image *image)
{
    if (image->comparison.non_finite == 0) return;
    const uint64_t count = image->comparison.non_finite;
    ca_say(stderr, "caustica: warning: %s: %llu %s not finite in it or in the reference and %s left out\n",
           image->path, (unsigned long long)count, ca_noun((double)count, "pixel is", "pixels are"),
           ca_noun((double)count, "was", "were"));
}

static ca_status compare_each(comparing *c, const ca_text_list *paths, char *const *map_names,
                              ca_compared_image *images, ca_error *error)
{
    for (size_t i = 0; i < paths->count; i++) {
        c->map_path = map_names ? map_names[i] : NULL;
        images[i] = (ca_compared_image){.path = paths->items[i]};
        CA_TRY(compare_file(c, &images[i], error));
        warn(&images[i]);
    }
    return CA_OK;
}

static void write_page(comparing *c)
{
    ca_error reason = {""};
    const ca_status status = ca_compare_page_finish(c->page, &reason);
    if (status == CA_OK) ca_say(stdout, "wrote %s\n", c->options->html);
    ca_output_note(&c->written, c->failure, status, &reason);
}

static void write_stats(comparing *c, const ca_compared_image *images, size_t count)
{
    const compare_options *o = c->options;
    ca_error reason = {""};
    const ca_status status = ca_stats_write_compare(o->stats, o->reference, &o->metrics, images, count, &reason);
    if (status == CA_OK) ca_say(stdout, "wrote %s\n", o->stats);
    ca_output_note(&c->written, c->failure, status, &reason);
}

/* A page that cannot be begun does not keep the rest from being measured. */
static void begin_page(comparing *c, ca_compare_page *page)
{
    const compare_options *o = c->options;
    ca_error reason = {""};
    const ca_status status =
        ca_compare_page_create(page, o->html, o->reference, c->region, o->html_layers, &reason);
    if (status == CA_OK) c->page = page;
    ca_output_note(&c->written, c->failure, status, &reason);
}

static ca_status compare_all(const compare_options *o, const ca_compare_settings *region, const ca_text_list *paths,
                             char *const *map_names, ca_compared_image *images, ca_error *error)
{
    ca_image_layers *reference = NULL;
    ca_compare_page page = {0};
    CA_TRY(ca_layers_read(o->reference, &reference, error));
    ca_error reason = {""};
    comparing c = {.options = o, .reference = reference, .region = region, .failure = error};
    if (o->html) begin_page(&c, &page);
    ca_status status = c.page ? ca_compare_page_check_layers(&page, paths, reference, &reason) : CA_OK;
    if (status == CA_OK) status = compare_each(&c, paths, map_names, images, &reason);
    if (status == CA_OK && c.page) write_page(&c);
    if (status == CA_OK && o->stats) write_stats(&c, images, paths->count);
    ca_output_note(&c.written, error, status, &reason);
    ca_compare_page_destroy(&page);
    ca_layers_destroy(reference);
    return c.written;
}

static ca_compare_settings region_of(const compare_options *o, ca_pixel_rect *masks)
{
    for (size_t i = 0; i < o->masks.count; i++) {
        const uint32_t *m = o->masks.items[i];
        masks[i] = (ca_pixel_rect){m[0], m[1], m[2], m[3]};
    }
    return (ca_compare_settings){
        .has_roi = o->has_roi,
        .roi = {o->roi[0], o->roi[1], o->roi[2], o->roi[3]},
        .masks = masks,
        .mask_count = o->masks.count,
        .block_side = o->block,
    };
}

/* What was asked for is possible: compares. */
static ca_status compare_images(compare_options *o, const ca_text_list *paths, ca_error *error)
{
    char **map_names = NULL;
    ca_status status = o->maps ? ca_compare_map_names(o->maps, paths, &o->places, &map_names, error) : CA_OK;
    ca_compared_image *images = ca_alloc_zeroed(paths->count, sizeof *images);
    ca_pixel_rect *masks = ca_alloc(o->masks.count, sizeof *masks);
    if (status == CA_OK && (!images || !masks)) status = ca_fail_memory(error, "the command line");
    if (status == CA_OK) {
        const ca_compare_settings region = region_of(o, masks);
        status = compare_all(o, &region, paths, map_names, images, error);
    }
    ca_free(images);
    ca_free(masks);
    ca_compare_map_names_destroy(map_names, paths->count);
    return status;
}

int ca_command_compare(int word_count, char *const words[])
{
    if (ca_help_wanted(word_count, words)) return print_help();
    compare_options o = defaults();
    ca_text_list paths = {0};
    ca_error error = {""};
    ca_status status = ca_options_parse(&table, word_count, words, &o, &paths, &error);
    if (status == CA_OK) status = check(&o, &paths, &error);
    if (status == CA_OK) status = compare_images(&o, &paths, &error);
    ca_places_destroy(&o.places);
    ca_rect_list_destroy(&o.masks);
    ca_text_list_destroy(&paths);
    return status == CA_OK ? CA_EXIT_DONE : ca_report("compare", status, &error);
}
