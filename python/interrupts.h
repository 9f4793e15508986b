/* Ctrl-C while the library works: a handler of SIGINT that sets the number which work polls (ca_render_settings.stop), and
 * then calls the handler that was there, Python's. Calls of several threads may overlap; all of them end. Begin and end are
 * called without Python's lock, which cffi lets go of, and have one of their own; the handler takes none. */
#include <pthread.h>
#include <signal.h>
#include <string.h>

static int caustica_stop;
static pthread_mutex_t caustica_watching = PTHREAD_MUTEX_INITIALIZER;
static int caustica_watchers;
static struct sigaction caustica_before;

static void caustica_on_interrupt(int signal, siginfo_t *info, void *context)
{
    __atomic_store_n(&caustica_stop, 1, __ATOMIC_RELAXED);
    if (caustica_before.sa_flags & SA_SIGINFO)
        caustica_before.sa_sigaction(signal, info, context);
    else if (caustica_before.sa_handler != SIG_DFL && caustica_before.sa_handler != SIG_IGN)
        caustica_before.sa_handler(signal);
}

/* What work polls; set once Ctrl-C was pressed, until the last call that watches has ended. */
static const int *caustica_watch_begin(void)
{
    pthread_mutex_lock(&caustica_watching);
    if (caustica_watchers++ == 0) {
        struct sigaction ours;
        memset(&ours, 0, sizeof ours);
        ours.sa_sigaction = caustica_on_interrupt;
        ours.sa_flags = SA_SIGINFO;
        sigaction(SIGINT, &ours, &caustica_before);
    }
    pthread_mutex_unlock(&caustica_watching);
    return &caustica_stop;
}

static void caustica_watch_end(void)
{
    pthread_mutex_lock(&caustica_watching);
    if (--caustica_watchers == 0) {
        sigaction(SIGINT, &caustica_before, NULL);
        __atomic_store_n(&caustica_stop, 0, __ATOMIC_RELAXED);
    }
    pthread_mutex_unlock(&caustica_watching);
}
