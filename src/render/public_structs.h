/* Structures of caustica.h that grow, as programs hand them over: those of a program that was compiled with an older
 * header are shorter. What it does not know of is 0 in its settings, and not written to its statistics. */
#ifndef CA_RENDER_PUBLIC_STRUCTS_H
#define CA_RENDER_PUBLIC_STRUCTS_H

#include "base/status.h"

/* The settings in today's length; NULL: all as the scene says. CA_ERROR_ARGUMENT: no version's size; fields set that
 * only a later version knows. */
ca_status ca_settings_take(const ca_render_settings *given, ca_render_settings *settings, ca_error *error);

/* The same of statistics, so that what a failed call does not write stays (NULL is allowed); and back. */
ca_status ca_statistics_take(const ca_render_statistics *given, ca_render_statistics *statistics, ca_error *error);
void ca_statistics_give(const ca_render_statistics *statistics, ca_render_statistics *given);

#endif
