/* Films and their reconstruction filters. Result of a filter plugin: ca_filter. */
#include "import/importer.h"

#include <string.h>

/* ---- Filters --------------------------------------------------------------------------------------------------- */

/* Wider filters would reach over too many pixels. */
static const double max_radius = 64.0;

static void import_box(ca_props *props, void *result)
{
    ca_filter *filter = result;
    *filter = ca_filter_default(CA_RFILTER_BOX);
    filter->radius = (float)ca_props_number_in(props, "radius", (double)filter->radius, 1e-3, max_radius);
}

static void import_tent(ca_props *props, void *result)
{
    ca_filter *filter = result;
    *filter = ca_filter_default(CA_RFILTER_TENT);
    filter->radius = (float)ca_props_number_in(props, "radius", (double)filter->radius, 1e-3, max_radius);
}

/* The radius keeps its ratio to the standard deviation. */
static void import_gaussian(ca_props *props, void *result)
{
    ca_filter *filter = result;
    *filter = ca_filter_default(CA_RFILTER_GAUSSIAN);
    const float ratio = filter->radius / filter->stddev;
    filter->stddev = (float)ca_props_number_in(props, "stddev", (double)filter->stddev, 1e-3, max_radius / 4.0);
    filter->radius = ratio * filter->stddev;
}

static void import_mitchell(ca_props *props, void *result)
{
    ca_filter *filter = result;
    *filter = ca_filter_default(CA_RFILTER_MITCHELL);
    filter->b = (float)ca_props_number_in(props, "B", (double)filter->b, -10.0, 10.0);
    filter->c = (float)ca_props_number_in(props, "C", (double)filter->c, -10.0, 10.0);
}

static void import_catmull_rom(ca_props *props, void *result)
{
    (void)props;
    *(ca_filter *)result = ca_filter_default(CA_RFILTER_CATMULL_ROM);
}

static void import_lanczos(ca_props *props, void *result)
{
    ca_filter *filter = result;
    *filter = ca_filter_default(CA_RFILTER_LANCZOS);
    filter->lobes = (float)ca_props_integer_in(props, "lobes", (int64_t)filter->lobes, 1, 32);
    filter->radius = filter->lobes;
}

static const ca_plugin filters[] = {
    {"box", import_box},
    {"tent", import_tent},
    {"gaussian", import_gaussian},
    {"mitchell", import_mitchell},
    {"catmullrom", import_catmull_rom},
    {"lanczos", import_lanczos},
};

static void import_filter(ca_importer *importer, ca_xml_node *node, ca_filter *filter)
{
    const ca_plugin *plugin = ca_import_find_plugin(importer, node, filters, CA_COUNT(filters));
    if (!plugin) return;
    ca_props props;
    ca_props_begin(&props, importer, node);
    plugin->import(&props, filter);
    ca_props_end(&props);
}

/* ---- Films ----------------------------------------------------------------------------------------------------- */

/* What Mitsuba's films know about output files, which the command line decides here. They may be given, without
 * effect. */
static const char *const without_effect[] = {
    "file_format", "pixel_format",   "component_format",
    "compensate",  "sample_border",  "high_quality_edges",
    "banner",      "attach_log",     "gamma",
    "exposure",    "tonemap_method", "key",
    "burn",        "label",
};

/* 0.6 writes text on the picture: label[10, 20]. */
static void skip_labels(ca_props *props)
{
    for (ca_xml_node *child = props->node->first_child; child; child = child->next) {
        const char *name = ca_xml_attribute_value(child, "name");
        if (name && strncmp(name, "label[", 6) == 0) child->used = true;
    }
}

static void import_crop(ca_props *props, ca_film_desc *film)
{
    film->crop_x = (uint32_t)ca_props_integer_in(props, "crop_offset_x", 0, 0, film->width - 1);
    film->crop_y = (uint32_t)ca_props_integer_in(props, "crop_offset_y", 0, 0, film->height - 1);
    const int64_t wide = film->width - film->crop_x, high = film->height - film->crop_y;
    const bool has_width = ca_props_find(props, "crop_width"), has_height = ca_props_find(props, "crop_height");
    film->crop_width = (uint32_t)ca_props_integer_in(props, "crop_width", wide, 1, wide);
    film->crop_height = (uint32_t)ca_props_integer_in(props, "crop_height", high, 1, high);
    if ((film->crop_x > 0 && !has_width) || (film->crop_y > 0 && !has_height))
        ca_props_fail(props, has_width ? "crop_offset_y" : "crop_offset_x", "needs crop_width and crop_height");
}

static void import_film(ca_props *props, void *result)
{
    ca_film_desc *film = result;
    film->width = (uint32_t)ca_props_integer_in(props, "width", 768, 1, CA_IMAGE_MAX_SIDE);
    film->height = (uint32_t)ca_props_integer_in(props, "height", 576, 1, CA_IMAGE_MAX_SIDE);
    if ((size_t)film->width * film->height > CA_IMAGE_MAX_PIXELS)
        ca_props_fail(props, "width", "times height is over the limit of 2^28 pixels");
    import_crop(props, film);
    for (size_t i = 0; i < CA_COUNT(without_effect); i++) ca_props_find(props, without_effect[i]);
    skip_labels(props);
    ca_xml_node *cursor = NULL;
    ca_xml_node *filter = ca_props_next_object(props, "rfilter", true, &cursor);
    if (!filter) return;
    import_filter(props->importer, filter, &film->filter);
    if (ca_props_next_object(props, "rfilter", true, &cursor))
        ca_import_fail(props->importer, &cursor->where, "a film has one rfilter, and this is a second");
}

void ca_import_filter(ca_importer *importer, ca_xml_node *node)
{
    import_filter(importer, node, &importer->desc->film.filter);
}

static const ca_plugin films[] = {{"hdrfilm", import_film}, {"ldrfilm", import_film}, {"tiledhdrfilm", import_film}};

void ca_import_film(ca_importer *importer, ca_xml_node *node)
{
    const ca_plugin *plugin = ca_import_find_plugin(importer, node, films, CA_COUNT(films));
    if (!plugin) return;
    ca_props props;
    ca_props_begin(&props, importer, node);
    plugin->import(&props, &importer->desc->film);
    ca_props_end(&props);
}
