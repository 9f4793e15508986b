/* Rows that the options of several commands share (options.h). What follows a row's words says where its value goes:
 * .offset, and .given where the command wants to know. */
#ifndef CA_CLI_SHARED_OPTIONS_H
#define CA_CLI_SHARED_OPTIONS_H

#include "cli/options.h"

/* ---- The scene ------------------------------------------------------------------------------------------------- */

#define CA_DEFINE_OPTION(...)                                                                                        \
    {.name = "define",                                                                                               \
     .letter = 'D',                                                                                                  \
     .argument = "NAME=VALUE",                                                                                       \
     .kind = CA_OPTION_TEXT_LIST,                                                                                    \
     .help = "value for a <default> of the scene; several times",                                                    \
     __VA_ARGS__}
#define CA_SENSOR_OPTION(...)                                                                                        \
    {.name = "sensor",                                                                                               \
     .argument = "N",                                                                                                \
     .kind = CA_OPTION_COUNT,                                                                                        \
     .help = "which of the scene's sensors, counted from 0 (default: 0)",                                            \
     __VA_ARGS__}
#define CA_CAMERA_OPTION(...)                                                                                        \
    {.name = "camera",                                                                                               \
     .argument = "NAME",                                                                                             \
     .kind = CA_OPTION_TEXT,                                                                                         \
     .help = "the sensor of that id instead (glTF: the name of its node)",                                           \
     __VA_ARGS__}

/* ---- A render -------------------------------------------------------------------------------------------------- */

#define CA_SEED_OPTION(...)                                                                                          \
    {.name = "seed",                                                                                                 \
     .argument = "N",                                                                                                \
     .kind = CA_OPTION_SEED,                                                                                         \
     .help = "other random numbers (default: the scene's, else 0)",                                                  \
     __VA_ARGS__}
#define CA_MAX_DEPTH_OPTION(...)                                                                                     \
    {.name = "max-depth",                                                                                            \
     .argument = "N",                                                                                                \
     .kind = CA_OPTION_INTEGER,                                                                                      \
     .minimum = -1,                                                                                                  \
     .help = "longest path in segments, 1: lights only, -1: no limit",                                               \
     __VA_ARGS__}
#define CA_RESOLUTION_OPTION(...)                                                                                    \
    {.name = "resolution",                                                                                           \
     .argument = "WxH",                                                                                              \
     .kind = CA_OPTION_SIZE,                                                                                         \
     .help = "size of the film (default: the scene's); its crop is scaled along",                                    \
     __VA_ARGS__}
/* `verb`: what is done with the part. */
#define CA_CROP_OPTION(verb, ...)                                                                                    \
    {.name = "crop",                                                                                                 \
     .argument = "x0,y0,x1,y1",                                                                                      \
     .kind = CA_OPTION_RECT,                                                                                         \
     .help = verb " this part only: pixels of the full film, half open",                                             \
     __VA_ARGS__}

/* ---- Any command ----------------------------------------------------------------------------------------------- */

/* `note`: "" or what does not depend on them. */
#define CA_THREADS_OPTION(note, ...)                                                                                 \
    {.name = "threads",                                                                                              \
     .argument = "N",                                                                                                \
     .kind = CA_OPTION_COUNT,                                                                                        \
     .minimum = 1,                                                                                                   \
     .help = "threads" note " (default: one per processor)",                                                         \
     __VA_ARGS__}
/* `limited`: what it limits. */
#define CA_MEMORY_OPTION(limited, ...)                                                                               \
    {.name = "memory",                                                                                               \
     .argument = "MiB",                                                                                              \
     .kind = CA_OPTION_POSITIVE,                                                                                     \
     .help = "limit for " limited,                                                                                   \
     __VA_ARGS__}
/* `numbers`: what is written. */
#define CA_STATS_OPTION(numbers, ...)                                                                                \
    {.name = "stats",                                                                                                \
     .argument = "FILE.json",                                                                                        \
     .kind = CA_OPTION_TEXT,                                                                                         \
     .help = "write " numbers " as JSON",                                                                            \
     __VA_ARGS__}
#define CA_MASK_OPTION(...)                                                                                          \
    {.name = "mask",                                                                                                 \
     .argument = "x0,y0,x1,y1",                                                                                      \
     .kind = CA_OPTION_RECT_LIST,                                                                                    \
     .help = "leave this part out; several times",                                                                   \
     __VA_ARGS__}
#define CA_QUIET_OPTION(...)                                                                                         \
    {.name = "quiet", .kind = CA_OPTION_FLAG, .help = "print errors and warnings only", __VA_ARGS__}
#define CA_HELP_OPTION(...)                                                                                          \
    {.name = "help", .letter = 'h', .kind = CA_OPTION_FLAG, .help = "this text", __VA_ARGS__}

#endif
