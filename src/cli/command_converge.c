/* caustica converge: how fast the error of several integrators falls, with samples and with time. */
#include "base/text.h"
#include "cli/commands.h"
#include "cli/converge.h"
#include "cli/outputs.h"
#include "cli/say.h"
#include "cli/shared_options.h"
#include "cli/signals.h"
#include "sampling/sampler.h"

#include <stdio.h>

#define AT(field) .offset = offsetof(ca_converge_options, field)
#define GIVEN(field) .given = offsetof(ca_converge_options, field)

static const ca_option options[] = {
    {.name = "integrator",
     .letter = 'i',
     .argument = "NAME[:param=value,...]",
     .kind = CA_OPTION_TEXT_LIST,
     AT(integrators),
     .help = "method, as of render; several times, or several with ';' between them (needed)"},
    {.name = "spp",
     .argument = "STEPS",
     .kind = CA_OPTION_TEXT,
     AT(spp),
     .help = "samples per pixel of the renders: 1,4,16 or 1:64 (1,2,4,...,64) or 1:1000:10 (1,10,100,1000)"},
    {.name = "time",
     .argument = "STEPS",
     .kind = CA_OPTION_TEXT,
     AT(time),
     .help = "instead: seconds of the renders, written likewise"},
    {.name = "reference",
     .letter = 'r',
     .argument = "FILE",
     .kind = CA_OPTION_TEXT,
     AT(reference),
     .help = "what is right (needed)"},
    {.name = "output",
     .letter = 'o',
     .argument = "FOLDER",
     .kind = CA_OPTION_TEXT,
     AT(folder),
     .help = "for renders and results; what is there is not rendered again (needed)"},
    {.name = "repeats",
     .argument = "N",
     .kind = CA_OPTION_COUNT,
     .minimum = 1,
     AT(repeats),
     .help = "renders of each step with other random numbers, for error bars (default: 1)"},
    {.name = "roi",
     .argument = "x0,y0,x1,y1",
     .kind = CA_OPTION_RECT,
     AT(roi),
     GIVEN(has_roi),
     .help = "measure this part only: pixels, half open (default: all)"},
    CA_MASK_OPTION(AT(masks)),
    {.name = "closeup",
     .argument = "x0,y0,x1,y1",
     .kind = CA_OPTION_RECT_LIST,
     AT(closeups),
     .help = "show this part enlarged; several times (default: a square where the error is largest)"},
    {.name = "exposure",
     .argument = "STOPS",
     .kind = CA_OPTION_REAL,
     AT(exposure),
     GIVEN(has_exposure),
     .help = "of the pictures, by powers of two (default: 95 of 100 pixels of the reference below 0.8)"},
    CA_DEFINE_OPTION(AT(defines)),
    {.name = "sampler",
     .argument = "NAME",
     .kind = CA_OPTION_TEXT,
     AT(settings.sampler),
     .help = "numbers of the paths, as of render"},
    CA_SEED_OPTION(AT(settings.seed), GIVEN(settings.has_seed)),
    CA_MAX_DEPTH_OPTION(AT(settings.max_depth), GIVEN(settings.has_max_depth)),
    CA_RESOLUTION_OPTION(AT(resolution)),
    CA_CROP_OPTION("render", AT(settings.crop), GIVEN(settings.has_crop)),
    CA_THREADS_OPTION("", AT(settings.threads)),
    CA_MEMORY_OPTION("film and paths of a render (default: as render has it)", AT(settings.memory_mib)),
    CA_QUIET_OPTION(AT(quiet)),
    CA_HELP_OPTION(AT(help)),
};
static const ca_option_table table = {"converge", options, sizeof options / sizeof options[0]};

static int print_help(void)
{
    printf("caustica converge SCENE -i LIST --spp STEPS | --time STEPS --reference FILE -o FOLDER [options]:\n"
           "render with several integrators, and see how fast their error falls (docs/converge.md)\n\n");
    ca_options_print(&table, stdout);
    printf("\n");
    ca_options_print_names("Samplers", ca_sampler_names(), stdout);
    printf("\n");
    ca_options_print_prose(
        "FOLDER/index.html shows the results: error against time and against samples with fitted slopes, "
        "pictures in equal time, standard deviations; images.html compares the images; renders.csv and "
        "converge.json have the numbers.\n"
        "The same command again renders only what is missing: steps, integrators and repeats can be "
        "added later.\n"
        "SIGINT (Ctrl-C), SIGTERM, SIGHUP, SIGXCPU and SIGUSR2 finish the render at work if that takes less than a "
        "second, and write the results of all complete steps, exit status 1; the same command goes on from there. "
        "A second SIGINT or SIGTERM ends at once.\n"
        "Example: caustica converge scene.xml -i \"path;ovcm:max_depth=8\" --spp 1:256 -r ref.exr -o results\n",
        stdout);
    return CA_EXIT_DONE;
}

/* One that cannot be written does not keep the others from it. */
static ca_status write_results(ca_converge *c, ca_error *error)
{
    static const struct {
        const char *name;
        ca_converge_put put;
    } files[] = {{"error-time.svg", ca_converge_put_time_plot}, {"error-samples.svg", ca_converge_put_samples_plot},
                 {"renders.csv", ca_converge_put_csv},          {"converge.json", ca_converge_put_json},
                 {"index.html", ca_converge_put_page}};
    ca_error reason = {""};
    ca_status all = ca_converge_write_pictures(c, error);
    ca_output_note(&all, error, ca_converge_write_images_page(c, &reason), &reason);
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++)
        ca_output_note(&all, error, ca_converge_write(c, files[i].name, files[i].put, &reason), &reason);
    return all;
}

static void print_summary(const ca_converge *c)
{
    printf("\nslopes of relMSE over time and over samples (95 %% intervals)\n");
    for (size_t i = 0; i < c->integrator_count; i++) {
        char over_time[64], over_samples[64];
        const ca_power_fit seconds = ca_converge_fit(c, i, CA_CONVERGE_RELMSE, true);
        const ca_power_fit samples = ca_converge_fit(c, i, CA_CONVERGE_RELMSE, false);
        ca_converge_fit_text(&seconds, over_time, sizeof over_time);
        ca_converge_fit_text(&samples, over_samples, sizeof over_samples);
        ca_say(stdout, "  %s: %s, %s\n", c->integrators[i].text, over_time[0] ? over_time : "-",
               over_samples[0] ? over_samples : "-");
    }
    ca_say(stdout, "wrote %s/index.html\n", c->options->folder);
}

/* Whatever failed, the steps that are complete are written. */
static ca_status make(ca_converge *c, ca_error *error)
{
    ca_error reason = {""};
    ca_status status = ca_converge_render_all(c, error);
    if (c->steps_done == 0) return status;
    ca_output_note(&status, error, write_results(c, &reason), &reason);
    if (status == CA_OK && !c->options->quiet) print_summary(c);
    return status;
}

/* *complete: no signal came in between. */
static ca_status run(const ca_converge_options *o, bool *complete, ca_error *error)
{
    ca_converge c;
    ca_status status = ca_converge_open(&c, o, error);
    if (status == CA_OK) status = make(&c, error);
    *complete = c.renders_done == c.render_count;
    if (status == CA_OK && !*complete) {
        fflush(stdout);
        fprintf(stderr, "caustica: ended by a signal after %zu of %zu %s; the same command goes on from there\n",
                c.renders_done, c.render_count, ca_noun((double)c.render_count, "render", "renders"));
    }
    ca_converge_destroy(&c);
    return status;
}

int ca_command_converge(int word_count, char *const words[])
{
    if (ca_help_wanted(word_count, words)) return print_help();
    ca_converge_options o = {.repeats = 1};
    ca_text_list operands = {0};
    ca_error error = {""};
    bool complete = true;
    ca_render_settings_init(&o.settings);
    ca_status status = ca_options_parse(&table, word_count, words, &o, &operands, &error);
    if (status == CA_OK) status = ca_options_scene_operand(&operands, &o.scene, &error);
    ca_signals_catch_save(); /* pictures are written when they are done: the work goes on */
    if (status == CA_OK) status = run(&o, &complete, &error);
    ca_signals_release_save();
    ca_text_list_destroy(&o.integrators);
    ca_text_list_destroy(&o.defines);
    ca_text_list_destroy(&operands);
    ca_rect_list_destroy(&o.masks);
    ca_rect_list_destroy(&o.closeups);
    if (status != CA_OK) return ca_report("converge", status, &error);
    return complete ? CA_EXIT_DONE : CA_EXIT_FAILED;
}
