#include "render/public_structs.h"

#include <string.h>

/* What the structures were in version 0.1: up to and with their last fields then. */
enum {
    SETTINGS_0_1 = offsetof(ca_render_settings, stop) + sizeof(const int *),
    STATISTICS_0_1 = offsetof(ca_render_statistics, passes_resumed) + sizeof(uint64_t)
};

static ca_status check_size(size_t size, size_t first, const char *what, ca_error *error)
{
    if (size == 0 || size >= first) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "the size of the %s is %zu bytes, which no version had: ca_render_%s_init sets it", what, size, what);
}

ca_status ca_settings_take(const ca_render_settings *given, ca_render_settings *settings, ca_error *error)
{
    *settings = (ca_render_settings){.size = sizeof *settings};
    if (!given) return CA_OK;
    CA_TRY(check_size(given->size, SETTINGS_0_1, "settings", error));
    const size_t size = given->size ? given->size : SETTINGS_0_1;
    for (size_t i = sizeof *settings; i < size; i++)
        if (((const unsigned char *)given)[i] != 0)
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                           "the settings have a field set that version %s of the library does not know", ca_version());
    memcpy(settings, given, size < sizeof *settings ? size : sizeof *settings);
    settings->size = sizeof *settings;
    return CA_OK;
}

static size_t known_size(size_t size)
{
    if (size == 0) return STATISTICS_0_1;
    return size < sizeof(ca_render_statistics) ? size : sizeof(ca_render_statistics);
}

ca_status ca_statistics_take(const ca_render_statistics *given, ca_render_statistics *statistics, ca_error *error)
{
    *statistics = (ca_render_statistics){0};
    if (!given) return CA_OK;
    CA_TRY(check_size(given->size, STATISTICS_0_1, "statistics", error));
    memcpy(statistics, given, known_size(given->size));
    return CA_OK;
}

void ca_statistics_give(const ca_render_statistics *statistics, ca_render_statistics *given)
{
    if (!given) return;
    const size_t size = given->size;
    memcpy(given, statistics, known_size(size));
    given->size = size;
}
