#define _POSIX_C_SOURCE 200809L
#include "cli/signals.h"

#include <errno.h>
#include <signal.h>
#include <unistd.h>

static const int ending[] = {SIGINT, SIGTERM, SIGHUP, SIGXCPU, SIGUSR2};
enum { ENDING_COUNT = sizeof ending / sizeof ending[0] };

/* A signal handler has nothing else to leave its message in. */
static volatile sig_atomic_t arrived, by_hand, is_quiet, wants_save;
static int stop; /* atomic */
static struct sigaction previous[ENDING_COUNT], previous_save, previous_alarm;

/* What a pass may take that was begun when the signal came, in seconds. */
enum { PATIENCE = 1 };

/* These four: only calls that are safe in a handler (POSIX, "Async-signal-safe functions"). */
static void say(bool is_by_hand)
{
    static const char text[] = "\ncaustica: finishing this pass or block, then the result is written\n";
    static const char by_hand_text[] =
        "\ncaustica: finishing this pass or block, then the result is written (again: stop at once)\n";
    const ssize_t count = is_by_hand ? write(STDERR_FILENO, by_hand_text, sizeof by_hand_text - 1)
                                     : write(STDERR_FILENO, text, sizeof text - 1);
    (void)count; /* standard error may be closed */
}

static void on_end(int number)
{
    const int reason = errno;
    const bool is_by_hand = number == SIGINT || number == SIGTERM;
    if (is_by_hand && by_hand) {
        signal(number, SIG_DFL);
        raise(number);
        return;
    }
    const bool is_news = is_by_hand || !arrived;
    if (!arrived) alarm(PATIENCE);
    if (is_by_hand) by_hand = 1;
    arrived = 1;
    if (!is_quiet && is_news) say(is_by_hand);
    errno = reason;
}

static void on_alarm(int number)
{
    (void)number;
    __atomic_store_n(&stop, 1, __ATOMIC_RELAXED);
}

static void on_save(int number)
{
    (void)number;
    wants_save = 1;
}

static void catch_one(int number, void (*handler)(int), struct sigaction *before)
{
    struct sigaction action = {.sa_handler = handler, .sa_flags = SA_RESTART};
    sigemptyset(&action.sa_mask);
    sigaction(number, NULL, before);
    /* Whoever started the program with the signal ignored (nohup) wants it to stay so. */
    if (before->sa_handler != SIG_IGN) sigaction(number, &action, NULL);
}

void ca_signals_catch(bool quiet)
{
    arrived = by_hand = 0;
    is_quiet = quiet;
    __atomic_store_n(&stop, 0, __ATOMIC_RELAXED);
    const struct sigaction action = {.sa_handler = on_alarm, .sa_flags = SA_RESTART};
    sigaction(SIGALRM, &action, &previous_alarm);
    for (int i = 0; i < ENDING_COUNT; i++) catch_one(ending[i], on_end, &previous[i]);
}

bool ca_signals_arrived(void) { return arrived != 0; }

const int *ca_signals_stop(void) { return &stop; }

void ca_signals_release(void)
{
    for (int i = 0; i < ENDING_COUNT; i++) sigaction(ending[i], &previous[i], NULL);
    alarm(0);
    sigaction(SIGALRM, &previous_alarm, NULL);
}

void ca_signals_catch_save(void)
{
    wants_save = 0;
    catch_one(SIGUSR1, on_save, &previous_save);
}

bool ca_signals_take_save(void)
{
    if (!wants_save) return false;
    wants_save = 0; /* one that came in between is answered by the picture that is written now */
    return true;
}

void ca_signals_release_save(void) { sigaction(SIGUSR1, &previous_save, NULL); }
