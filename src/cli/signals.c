#define _POSIX_C_SOURCE 200809L
#include "cli/signals.h"

#include <signal.h>
#include <unistd.h>

/* A signal handler has nothing else to leave its message in. */
static volatile sig_atomic_t arrived, is_quiet;
static struct sigaction previous_int, previous_term;

/* Only calls that are safe in a handler (POSIX, "Async-signal-safe functions"). */
static void on_signal(int number)
{
    if (arrived) {
        signal(number, SIG_DFL);
        raise(number);
        return;
    }
    arrived = 1;
    static const char text[] =
        "\ncaustica: finishing this pass or block, then the result is written (again: stop at once)\n";
    if (!is_quiet && write(STDERR_FILENO, text, sizeof text - 1) < 0) return; /* standard error is closed */
}

static void catch_one(int number, struct sigaction *previous)
{
    struct sigaction action = {.sa_handler = on_signal, .sa_flags = SA_RESTART};
    sigemptyset(&action.sa_mask);
    sigaction(number, NULL, previous);
    /* Whoever started the program with the signal ignored (nohup) wants it to stay so. */
    if (previous->sa_handler != SIG_IGN) sigaction(number, &action, NULL);
}

void ca_signals_catch(bool quiet)
{
    arrived = 0;
    is_quiet = quiet;
    catch_one(SIGINT, &previous_int);
    catch_one(SIGTERM, &previous_term);
}

bool ca_signals_arrived(void) { return arrived != 0; }

void ca_signals_release(void)
{
    sigaction(SIGINT, &previous_int, NULL);
    sigaction(SIGTERM, &previous_term, NULL);
}
