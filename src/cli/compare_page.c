#include "cli/compare_page.h"

#include "image/layers.h"

#include <math.h>

enum { METRICS = 10 };

ca_status ca_compare_page_create(ca_compare_page *page, const char *path, const char *reference,
                                 const ca_compare_settings *region, const char *layers, ca_error *error)
{
    *page = (ca_compare_page){
        .settings = {.title = "caustica compare",
                     .layers = layers,
                     .maps = "SSIM,FLIP.LDR,FLIP.HDR", /* the page makes differences itself */
                     .roi = region->has_roi ? &region->roi : NULL,
                     .masks = region->masks,
                     .mask_count = region->mask_count},
        .reference = reference,
    };
    return ca_page_create(&page->page, path, &page->settings, error);
}

ca_status ca_compare_page_check_layers(ca_compare_page *page, const ca_text_list *images,
                                       const ca_image_layers *reference, ca_error *error)
{
    bool all = ca_page_expect(page->page, reference);
    for (size_t i = 0; i < images->count && !all; i++) {
        ca_image_layers *layers = NULL;
        CA_TRY(ca_layers_read(images->items[i], &layers, error));
        all = ca_page_expect(page->page, layers);
        ca_layers_destroy(layers);
    }
    return all ? CA_OK : ca_page_check(page->page, error);
}

static ca_status add_reference(ca_compare_page *page, const ca_image_layers *layers, ca_error *error)
{
    const ca_page_image image = {.name = page->reference, .is_reference = true, .layers = layers};
    page->has_reference = true;
    return ca_page_add(page->page, &image, error);
}

static double relative_luminance(const ca_comparison *c)
{
    return 100.0 * (c->mean_luminance / c->reference_mean_luminance - 1.0);
}

/* A column for each; those that were not computed are not known in any image. */
static size_t metrics_of(const ca_compared_image *image, ca_page_metric metrics[METRICS])
{
    const ca_comparison *c = &image->comparison;
    const ca_page_metric all[METRICS] = {
        {"RMSE", "root of the mean of (A − B)²", c->rmse, CA_PAGE_LOWER},
        {"MAE", "mean of |A − B|", c->mae, CA_PAGE_LOWER},
        {"relMSE", "mean of (A − B)² / (B² + 0.01)", c->relmse, CA_PAGE_LOWER},
        {"SMAPE", "mean of |A − B| / (|A| + |B| + 0.01)", c->smape, CA_PAGE_LOWER},
        {"SSIM", "mean structural similarity, 1: equal", image->metrics.ssim, CA_PAGE_HIGHER},
        {"FLIP.LDR", "mean ꟻLIP of what a display shows, 0: equal", image->metrics.flip_ldr, CA_PAGE_LOWER},
        {"FLIP.HDR", "mean ꟻLIP over exposures, 0: equal", image->metrics.flip_hdr, CA_PAGE_LOWER},
        {"brightness %", "mean luminance against the reference's", relative_luminance(c), CA_PAGE_NEITHER},
        {"block means %", "median over blocks of the difference of their means", 100.0 * c->median_block_difference,
         CA_PAGE_LOWER},
        {"blocks differing",
         "blocks that differ by more than noise explains (5 % false alarms for the whole picture)",
         c->test.done ? (double)c->test.rejected : (double)NAN, CA_PAGE_LOWER},
    };
    for (size_t i = 0; i < METRICS; i++) metrics[i] = all[i];
    return METRICS;
}

ca_status ca_compare_page_add(ca_compare_page *page, const ca_compared_image *image, const ca_image_layers *layers,
                              const ca_image_layers *reference, const ca_image_layers *maps, ca_error *error)
{
    if (!page->has_reference) CA_TRY(add_reference(page, reference, error));
    ca_page_metric metrics[METRICS];
    const ca_page_image added = {
        .name = image->path,
        .layers = layers,
        .maps = maps,
        .metrics = metrics,
        .metric_count = metrics_of(image, metrics),
    };
    return ca_page_add(page->page, &added, error);
}

ca_status ca_compare_page_finish(ca_compare_page *page, ca_error *error) { return ca_page_finish(page->page, error); }

void ca_compare_page_destroy(ca_compare_page *page)
{
    ca_page_destroy(page->page);
    *page = (ca_compare_page){0};
}
