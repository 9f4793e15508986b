/* caustica converge: index.html, which shows all results. Plots are in it, pictures beside it; it needs no script. */
#include "base/text.h"
#include "cli/converge.h"
#include "report/page_text.h"
#include "report/plot.h"

#include <math.h>
#include <string.h>

static const char head[] =
    "<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n"
    "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src 'self' file: http: https:; "
    "style-src 'unsafe-inline'\">\n"
    "<meta name=\"viewport\" content=\"width=device-width\">\n<title>caustica converge</title>\n<style>\n"
    "body { margin: 1.5em auto; max-width: 90em; padding: 0 1em; font: 14px/1.5 \"DejaVu Sans\", Arial, sans-serif;\n"
    "       background: #f4f4f4; color: #202020; }\n"
    "h1 { font-size: 1.4em; } h2 { font-size: 1.15em; margin-top: 2em; }\n"
    "table { border-collapse: collapse; font-size: 13px; } th, td { padding: 2px 9px; text-align: right; "
    "border-bottom: 1px solid #ccc;\n"
    "         white-space: nowrap; }\n"
    "th:first-child, td:first-child { text-align: left; } td { font-variant-numeric: tabular-nums; }\n"
    "i { display: inline-block; width: 10px; height: 10px; margin-right: 6px; }\n"
    ".scroll { overflow-x: auto; } .row { display: flex; flex-wrap: wrap; gap: 10px; margin: 10px 0; }\n"
    "figure { margin: 0; width: 212px; } figcaption { font-size: 12px; overflow-wrap: anywhere; }\n"
    "figure div { position: relative; background: #000; } img { display: block; width: 100%; }\n"
    ".pixels { image-rendering: pixelated; }\n"
    "figure b { position: absolute; border: 1.5px solid #f33; }\n"
    "</style>\n";

/* ---- Words ----------------------------------------------------------------------------------------------------- */

static void put_intro(const ca_converge *c, FILE *stream)
{
    fputs("<h1>caustica converge: ", stream);
    ca_page_put_html(stream, c->options->scene);
    fputs("</h1>\n<p>Against <b>", stream);
    ca_page_put_html(stream, c->options->reference);
    fprintf(stream, "</b>, %u × %u pixels. %zu of %zu %s, %zu %s at each, %u %s. ", c->reference->width,
            c->reference->height, c->steps_done, c->step_count, ca_noun((double)c->step_count, "step", "steps"),
            c->repeats, ca_noun((double)c->repeats, "render", "renders"), c->metrics.threads,
            ca_noun(c->metrics.threads, "thread", "threads"));
    fputs("All images with their metrics: <a href=\"images.html\">images.html</a>. The numbers: "
          "<a href=\"renders.csv\">renders.csv</a>, <a href=\"converge.json\">converge.json</a>.",
          stream);
    if (c->reference_noise[0] >= 0.0)
        fprintf(stream, " The reference's own noise amounts to an RMSE of %.3g and a relMSE of %.3g.",
                c->reference_noise[0], c->reference_noise[1]);
    fputs("</p>\n", stream);
}

static void put_name(const ca_converge *c, FILE *stream, size_t integrator)
{
    fprintf(stream, "<tr><td><i style=\"background: %s\"></i>", ca_plot_colour((unsigned)integrator + 1));
    ca_page_put_html(stream, c->integrators[integrator].text);
    fputs("</td>", stream);
}

/* Of one method, all of whose renders are told of with the first one. */
static void put_choice(const ca_converge *c, FILE *stream, size_t first, size_t count)
{
    const char *method = c->renders[first].method;
    const size_t integrator = c->renders[first].integrator, length = strcspn(method, ":");
    size_t made = 0;
    for (size_t i = 0; i < count; i++) {
        const ca_converge_render *r = &c->renders[i];
        if (r->integrator != integrator || strcspn(r->method, ":") != length) continue;
        if (strncmp(r->method, method, length) != 0) continue;
        if (i < first) return;
        made++;
    }
    fputs("<p><b>", stream);
    ca_page_put_html(stream, c->integrators[integrator].text);
    fprintf(stream, "</b> took %.*s in %zu %s.</p>\n", (int)length, method, made,
            ca_noun((double)made, "render", "renders"));
}

/* Which methods `auto` took. */
static void put_choices(const ca_converge *c, FILE *stream)
{
    const size_t count = c->steps_done * c->integrator_count * c->repeats;
    for (size_t i = 0; i < count; i++)
        if (ca_converge_chosen(c, &c->renders[i])) put_choice(c, stream, i, count);
}

static void put_cell(FILE *stream, double value)
{
    if (isfinite(value))
        fprintf(stream, "<td>%.4g</td>", value);
    else
        fputs("<td>–</td>", stream);
}

static void put_slopes(const ca_converge *c, FILE *stream)
{
    fputs("<h2>How fast the error falls</h2>\n<div class=\"scroll\"><table>\n<tr><th>slope of</th>", stream);
    for (int m = 0; m < CA_CONVERGE_METRICS; m++)
        if (ca_converge_metric_texts[m].plotted)
            fprintf(stream, "<th>%s<br>over time</th><th><br>over samples</th>", ca_converge_metric_texts[m].error);
    fputs("</tr>\n", stream);
    for (size_t i = 0; i < c->integrator_count; i++) {
        put_name(c, stream, i);
        for (int m = 0; m < CA_CONVERGE_METRICS; m++)
            for (int over_time = 1; ca_converge_metric_texts[m].plotted && over_time >= 0; over_time--) {
                char text[64];
                const ca_power_fit fit = ca_converge_fit(c, i, (ca_converge_metric)m, over_time != 0);
                ca_converge_fit_text(&fit, text, sizeof text);
                fprintf(stream, "<td>%s</td>", text[0] ? text : "–");
            }
        fputs("</tr>\n", stream);
    }
    fputs("</table></div>\n<p>Exponents of the law error = a · x<sup>b</sup>, by least squares of the logarithms "
          "over all renders, "
          "with their 95 % intervals. Noise alone gives −0.5 for RMSE and −1 for relMSE. Near the reference's own "
          "noise "
          "curves turn level, and these numbers say nothing.</p>\n",
          stream);
}

static void put_ends(const ca_converge *c, FILE *stream)
{
    char step[64];
    ca_converge_step_text(c, c->steps_done - 1, step, sizeof step);
    fprintf(stream, "<h2>At the last step, %s</h2>\n<div class=\"scroll\"><table>\n<tr><th>mean</th>", step);
    for (int m = 0; m < CA_CONVERGE_METRICS; m++) fprintf(stream, "<th>%s</th>", ca_converge_metric_texts[m].error);
    fputs("<th>seconds</th><th>samples</th><th>σ of an<br>iteration</th><th>σ √seconds</th></tr>\n", stream);
    for (size_t i = 0; i < c->integrator_count; i++) {
        ca_converge_mean mean = {0};
        double seconds;
        const double deviation = ca_converge_deviation(c, i, &seconds);
        put_name(c, stream, i);
        for (int m = 0; m < CA_CONVERGE_METRICS; m++) {
            mean = ca_converge_mean_of(c, c->steps_done - 1, i, (ca_converge_metric)m);
            put_cell(stream, mean.error);
        }
        put_cell(stream, mean.seconds);
        put_cell(stream, mean.samples);
        put_cell(stream, deviation);
        put_cell(stream, deviation * sqrt(seconds));
        fputs("</tr>\n", stream);
    }
    fputs("</table></div>\n<p>σ is the standard deviation of one iteration's pixel luminance, averaged over pixels; "
          "times the root of "
          "an iteration's seconds it is what one second leaves of the noise.</p>\n",
          stream);
    put_choices(c, stream);
}

/* ---- Pictures -------------------------------------------------------------------------------------------------- */

/* The close-ups' frames, over the whole picture. */
static void put_frames(const ca_converge *c, FILE *stream)
{
    const double width = c->reference->width, height = c->reference->height;
    for (size_t k = 0; k < c->closeup_count; k++) {
        const ca_pixel_rect *r = &c->closeups[k];
        fprintf(stream, "<b style=\"left: %.2f%%; top: %.2f%%; width: %.2f%%; height: %.2f%%\"></b>",
                100.0 * r->x0 / width, 100.0 * r->y0 / height, 100.0 * (r->x1 - r->x0) / width,
                100.0 * (r->y1 - r->y0) / height);
    }
}

/* place 0: the whole picture; else a close-up. */
static void put_figure(const ca_converge *c, FILE *stream, const char *name, const char *kind, size_t place,
                       const char *text)
{
    fprintf(stream, "<figure><div><img src=\"pictures/%s%s", name, kind);
    if (place > 0) fprintf(stream, "-%zu", place);
    fputs(place > 0 ? ".png\" alt=\"\" class=\"pixels\">" : ".png\" alt=\"\">", stream);
    if (place == 0) put_frames(c, stream);
    fputs("</div><figcaption>", stream);
    ca_page_put_html(stream, text);
    fputs("</figcaption></figure>\n", stream);
}

static void put_equal_time(const ca_converge *c, FILE *stream)
{
    fprintf(stream, "<h2>In equal time, %.3g s</h2>\n", ca_converge_equal_seconds(c));
    if (!c->by_time)
        fputs("<p>Of the steps of each integrator the one nearest to it; the captions have the times. Steps of "
              "--time are "
              "equal.</p>\n",
              stream);
    for (size_t place = 0; place <= c->closeup_count; place++) {
        fputs("<div class=\"row\">\n", stream);
        put_figure(c, stream, "reference", "", place, "reference");
        for (size_t i = 0; i < c->integrator_count; i++) {
            const ca_converge_render *r = ca_converge_equal_time(c, i);
            char text[256];
            snprintf(text, sizeof text, "%.120s: %.3g s, %.4g spp, relMSE %.3g", c->integrators[i].text, r->seconds,
                     r->samples_per_pixel, r->metrics[CA_CONVERGE_RELMSE]);
            put_figure(c, stream, c->integrators[i].name, "", place, text);
        }
        fputs("</div>\n", stream);
    }
}

static void put_deviations(const ca_converge *c, FILE *stream)
{
    fputs("<h2>Standard deviation of one iteration</h2>\n<p>Of a pixel's luminance, from the iterations of the last "
          "step; all at "
          "one scale, darker is better.</p>\n",
          stream);
    for (size_t place = 0; place <= c->closeup_count; place++) {
        fputs("<div class=\"row\">\n", stream);
        for (size_t i = 0; i < c->integrator_count; i++) {
            char text[256];
            double seconds;
            const double deviation = ca_converge_deviation(c, i, &seconds);
            if (isnan(deviation)) continue;
            snprintf(text, sizeof text, "%.120s: σ %.3g, %.3g s an iteration", c->integrators[i].text, deviation,
                     seconds);
            put_figure(c, stream, c->integrators[i].name, "-deviation", place, text);
        }
        fputs("</div>\n", stream);
    }
    for (size_t i = 0; i < c->integrator_count; i++) {
        double seconds;
        if (!isnan(ca_converge_deviation(c, i, &seconds))) continue;
        fputs("<p>Not known of ", stream);
        ca_page_put_html(stream, c->integrators[i].text);
        fputs(": it made fewer than two iterations that are independent of each other.</p>\n", stream);
    }
}

ca_status ca_converge_put_page(const ca_converge *c, FILE *stream, ca_error *error)
{
    fputs(head, stream);
    put_intro(c, stream);
    put_slopes(c, stream);
    fputs("<h2>Error against time</h2>\n<div class=\"scroll\">", stream);
    CA_TRY(ca_converge_put_time_plot(c, stream, error));
    fputs("</div>\n<h2>Error against samples</h2>\n<div class=\"scroll\">", stream);
    CA_TRY(ca_converge_put_samples_plot(c, stream, error));
    fputs("</div>\n", stream);
    put_ends(c, stream);
    put_equal_time(c, stream);
    put_deviations(c, stream);
    fputs("</html>\n", stream);
    return CA_OK;
}
