#include "cli/commands.h"
#include "cli/say.h"

#include <stdio.h>
#include <string.h>

int ca_report_usage(const char *command, const ca_error *error)
{
    ca_say(stderr, "caustica: %s\n", error->message);
    fprintf(stderr, "Try: caustica %s%s--help\n", command ? command : "", command ? " " : "");
    return CA_EXIT_USAGE;
}

int ca_report_failure(const ca_error *error)
{
    ca_say(stderr, "caustica: %s\n", error->message);
    return CA_EXIT_FAILED;
}

int ca_report(const char *command, ca_status status, const ca_error *error)
{
    return status == CA_ERROR_ARGUMENT ? ca_report_usage(command, error) : ca_report_failure(error);
}

bool ca_help_wanted(int word_count, char *const words[])
{
    for (int i = 0; i < word_count && strcmp(words[i], "--") != 0; i++)
        if (strcmp(words[i], "--help") == 0 || strcmp(words[i], "-h") == 0) return true;
    return false;
}
