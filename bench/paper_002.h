/* What the comparison of paper 002 (Jendersie 2019, figures 2 and 6) has rendered, for its report. */
#ifndef CA_BENCH_PAPER_002_H
#define CA_BENCH_PAPER_002_H

#include "caustica.h"
#include "deviation.h"

#include <stdio.h>

/* From VCM on they merge, with the same bias of the radius, and their mean is the reference. `path` and photon
 * mapping are looked at only where they are right, and leave the others' pixels as they are. */
enum {
    PATH,
    PPM,
    BDPT,
    VCM,
    VCM_SUMS,
    VCM_PLUS,
    VCM_PLUS_AUTHOR,
    VCM_STAR,
    VCM_STAR_AUTHOR,
    OVCM,
    CAVCM,
    VAVCM,
    OVCM_C0,
    OVCM_PROJECTED,
    ESTIMATORS
};

typedef struct estimator {
    const char *name;       /* in tables */
    const char *integrator; /* for ca_render, but for the radius */
} estimator;
extern const estimator estimators[ESTIMATORS];

typedef struct comparison_scene {
    const char *name, *file, *what;
    bool shared;           /* file: within the folder of shared scenes, else within the project's scenes */
    bool without_specular; /* pixels that show glass or metal are left out */
    double minutes;    /* its share of the whole's time, on two quiet processors */
    double radius;     /* of merges, m */
    double closeup[3]; /* left, top, side: fractions of the picture's width */
} comparison_scene;

enum { TIME_ROUNDS = 5 };

typedef struct estimator_run {
    char integrator[96];
    batches samples;
    uint32_t passes; /* so far; its next one has the random numbers that other estimators' pass of that number has */
    double *deviation;                                    /* [pixel], owned */
    bool *counts;                                         /* [pixel], owned */
    double sharpness;                                     /* find_consistent_pixels */
    double seconds[TIME_ROUNDS];                          /* of one iteration */
    double memory;                                        /* bytes, peak of a process of its own */
    double common[1 + BOOTSTRAP], merging[1 + BOOTSTRAP]; /* sigma-bar on the pixels below */
    double own[1 + BOOTSTRAP], ovcm[1 + BOOTSTRAP]; /* where this one and ovcm count: its own, and ovcm's */
    double own_share;                               /* of the pixels, these */
} estimator_run;

typedef struct scene_run {
    const comparison_scene *scene;
    char path[1024]; /* of the scene file; empty: not to be found */
    uint32_t width, height;
    uint32_t iterations; /* so far, of all estimators; some have gone on alone (runs[].samples.iterations) */
    estimator_run runs[ESTIMATORS];
    float *fifty[3]; /* owned, R G B of 50 iterations of bdpt, vcm, ovcm, [channel][pixel]; NULL: not made */
    float *picture; /* owned, mean R G B over the merging estimators, [channel][pixel] */
    bool *left_out; /* owned, [pixel] */
    bool *common;   /* owned: where all estimators count ... */
    bool *merging;  /* ... and where all but bdpt do */
    int first_precise; /* estimators from this one on are rendered until their intervals are narrow */
    bool rendered; /* deviations are known */
    bool timed;    /* times and memory are */
} scene_run;

/* Half of the 95 % interval of an estimator's sigma-bar over that, the wider one where a row has two; 0: it counts
 * nowhere. */
double report_interval(const scene_run *run, int which);
/* The widest of these that the run makes narrow. */
double report_widest_interval(const scene_run *run);
/* The scene's heading, table and pictures as Markdown. */
void report_scene(FILE *out, const scene_run *run);
/* A table of times of an iteration and of memory, of the scenes that are timed. */
void report_times(FILE *out, const scene_run *runs, int count);
/* What the comparison should show; returns how many checks failed. */
int report_checks(FILE *out, const scene_run *runs, int count);

/* Writes FOLDER/<scene>-50.png: figure 2, the same 50 iterations of bdpt, vcm and ovcm side by side. */
ca_status write_figure_2(const scene_run *run, const char *folder, ca_error *error);

/* Writes FOLDER/<scene>.png: the picture, and the close-up's standard deviations of path, ppm, bdpt, vcm, vcm-star,
 * ovcm at one scale, that of the last four. */
ca_status write_closeups(const scene_run *run, const char *folder, ca_error *error);

#endif
