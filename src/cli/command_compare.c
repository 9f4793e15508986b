/* caustica compare: how much images differ from a reference, and whether noise explains it. */
#include "base/memory.h"
#include "cli/commands.h"
#include "cli/outputs.h"
#include "cli/stats_json.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

typedef struct compare_options {
    const char *reference, *stats;
    uint32_t roi[4], block;
    bool has_roi, resample, help;
    ca_rect_list masks;
} compare_options;

#define AT(field) .offset = offsetof(compare_options, field)

static const ca_option options[] = {
    {.name = "reference", .letter = 'r', .argument = "FILE", .kind = CA_OPTION_TEXT, AT(reference),
     .help = "what to compare with (needed)"},
    {.name = "roi", .argument = "x0,y0,x1,y1", .kind = CA_OPTION_RECT, AT(roi),
     .given = offsetof(compare_options, has_roi), .help = "look at this part only: pixels, half open (default: all)"},
    {.name = "mask", .argument = "x0,y0,x1,y1", .kind = CA_OPTION_RECT_LIST, AT(masks),
     .help = "leave this part out; several times"},
    {.name = "block", .argument = "N", .kind = CA_OPTION_COUNT, .minimum = 1, AT(block),
     .help = "side of the blocks that are tested (default: 16)"},
    {.name = "resample-reference", .kind = CA_OPTION_FLAG, AT(resample),
     .help = "average a reference that is a whole number of times larger"},
    {.name = "stats", .argument = "FILE.json", .kind = CA_OPTION_TEXT, AT(stats), .help = "write the numbers as JSON"},
    {.name = "help", .letter = 'h', .kind = CA_OPTION_FLAG, AT(help), .help = "this text"},
};
static const ca_option_table table = {"compare", options, sizeof options / sizeof options[0]};

static int print_help(void)
{
    printf("caustica compare IMAGE... --reference FILE [options]: measure how images differ from a reference\n\n");
    ca_options_print(&table, stdout);
    printf("\n"
           "Prints RMSE, MAE and relMSE (denominator B^2 + 0.01) over R, G and B, the mean luminances, the median over\n"
           "blocks of the relative difference of block means and, where the image has the layers Variance.* and\n"
           "Samples.Y, how many blocks differ by more than noise explains (5 %% false alarms for the whole picture).\n"
           "A difference is no failure: the exit status is 0 when the images could be compared.\n"
           "Example: caustica compare a.exr b.exr --reference ref.exr --mask 100,0,156,20\n");
    return CA_EXIT_DONE;
}

static ca_status check(const compare_options *o, const ca_text_list *images, ca_error *error)
{
    if (!o->reference) return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "option --reference is missing");
    if (images->count == 0) return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "an image to compare is missing");
    return o->stats ? ca_output_check_place(o->stats, error) : CA_OK;
}

/* ---- Printing --------------------------------------------------------------------------------------------------- */

static void print_test(const ca_block_test *test)
{
    if (!test->done) {
        printf("  block test          not done: %s\n", test->blocks_untested ? "each block has a pixel of unknown variance"
                                                                             : "the image has no Variance.* and Samples.Y");
        return;
    }
    printf("  blocks that differ  %u of %u (p = %.3g for the whole picture)\n", test->rejected, test->blocks,
           test->p_value);
    printf("  would detect        a bias of %.3g %% (at 5 %% significance, 80 %% power)\n", 100.0 * test->detectable_bias);
    if (test->blocks_untested) printf("  not tested          %u blocks of unknown variance\n", test->blocks_untested);
    if (test->reference_exact) printf("  note                the reference tells no variance: taken as exact\n");
}

static void print_image(const ca_compared_image *image)
{
    const ca_comparison *c = &image->comparison;
    printf("%s\n", image->path);
    printf("  RMSE                %.6g\n", c->rmse);
    printf("  MAE                 %.6g\n", c->mae);
    printf("  relMSE              %.6g\n", c->relmse);
    printf("  mean luminance      %.6g, of the reference %.6g (%+.3f %%)\n", c->mean_luminance,
           c->reference_mean_luminance, 100.0 * (c->mean_luminance / c->reference_mean_luminance - 1.0));
    if (c->blocks > 0)
        printf("  block means         %.3f %% apart (median of %u blocks)\n", 100.0 * c->median_block_difference, c->blocks);
    print_test(&c->test);
    if (c->masked || c->blocks_left_out)
        printf("  left out            %llu pixels by masks, %u blocks for it\n", (unsigned long long)c->masked,
               c->blocks_left_out);
}

/* ---- Comparing -------------------------------------------------------------------------------------------------- */

/* By how much the reference is larger, the same in both directions; 0 where that is no whole number. */
static uint32_t size_ratio(const ca_image_layers *reference, const ca_image_layers *image)
{
    const uint32_t ratio = reference->width / image->width;
    const bool exact = ratio > 0 && (uint64_t)ratio * image->width == reference->width &&
                       (uint64_t)ratio * image->height == reference->height;
    return exact ? ratio : 0;
}

static ca_status compare_with(const compare_options *o, const ca_image_layers *image, const ca_image_layers *reference,
                              ca_comparison *comparison, ca_error *error)
{
    ca_pixel_rect *masks = ca_alloc(o->masks.count, sizeof *masks);
    if (!masks) return ca_fail_memory(error, "the masks");
    for (size_t i = 0; i < o->masks.count; i++) {
        const uint32_t *m = o->masks.items[i];
        masks[i] = (ca_pixel_rect){m[0], m[1], m[2], m[3]};
    }
    const ca_compare_settings settings = {
        .has_roi = o->has_roi,
        .roi = {o->roi[0], o->roi[1], o->roi[2], o->roi[3]},
        .masks = masks,
        .mask_count = o->masks.count,
        .block_side = o->block,
    };
    const ca_status status = ca_compare(image, reference, &settings, comparison, error);
    ca_free(masks);
    return status;
}

static ca_status compare_resampled(const compare_options *o, const ca_image_layers *image,
                                   const ca_image_layers *reference, ca_comparison *comparison, ca_error *error)
{
    const uint32_t ratio = o->resample ? size_ratio(reference, image) : 1;
    if (ratio == 1) return compare_with(o, image, reference, comparison, error);
    if (ratio == 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "the reference's %u x %u pixels are no multiple of the image's %u x %u", reference->width,
                       reference->height, image->width, image->height);
    ca_image_layers *small = NULL;
    CA_TRY(ca_compare_downsample(reference, ratio, &small, error));
    const ca_status status = compare_with(o, image, small, comparison, error);
    ca_layers_destroy(small);
    return status;
}

/* What is wrong with a picture is a failure, not wrong usage: the words were right. */
static ca_status compare_file(const compare_options *o, const ca_image_layers *reference, ca_compared_image *image,
                              ca_error *error)
{
    ca_image_layers *layers = NULL;
    CA_TRY(ca_layers_read(image->path, &layers, error));
    ca_error reason = {""};
    const ca_status status = compare_resampled(o, layers, reference, &image->comparison, &reason);
    ca_layers_destroy(layers);
    if (status == CA_OK) return CA_OK;
    return ca_fail(error, status == CA_ERROR_ARGUMENT ? CA_ERROR_UNSUPPORTED : status, NULL, "%s: %.900s", image->path,
                   reason.message);
}

static void warn(const ca_compared_image *image)
{
    if (image->comparison.non_finite == 0) return;
    fprintf(stderr, "caustica: warning: %s: %llu pixels are not finite in it or in the reference and were left out\n",
            image->path, (unsigned long long)image->comparison.non_finite);
}

static ca_status compare_all(const compare_options *o, const ca_text_list *paths, ca_compared_image *images,
                             ca_error *error)
{
    ca_image_layers *reference = NULL;
    CA_TRY(ca_layers_read(o->reference, &reference, error));
    ca_status status = CA_OK;
    for (size_t i = 0; i < paths->count && status == CA_OK; i++) {
        images[i] = (ca_compared_image){.path = paths->items[i]};
        status = compare_file(o, reference, &images[i], error);
        if (status != CA_OK) break;
        print_image(&images[i]);
        warn(&images[i]);
    }
    ca_layers_destroy(reference);
    if (status != CA_OK || !o->stats) return status;
    return ca_stats_write_compare(o->stats, o->reference, images, paths->count, error);
}

int ca_command_compare(int word_count, char *const words[])
{
    if (ca_help_wanted(word_count, words)) return print_help();
    compare_options o = {0};
    ca_text_list paths = {0};
    ca_compared_image *images = NULL;
    ca_error error = {""};
    ca_status status = ca_options_parse(&table, word_count, words, &o, &paths, &error);
    if (status == CA_OK) status = check(&o, &paths, &error);
    if (status == CA_OK) {
        images = ca_alloc_zeroed(paths.count, sizeof *images);
        status = images ? compare_all(&o, &paths, images, &error) : ca_fail_memory(&error, "the command line");
    }
    ca_free(images);
    ca_rect_list_destroy(&o.masks);
    ca_text_list_destroy(&paths);
    return status == CA_OK ? CA_EXIT_DONE : ca_report("compare", status, &error);
}
