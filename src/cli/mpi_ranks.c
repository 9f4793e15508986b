#include "cli/mpi_ranks.h"

#include "cli/values.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef CA_HAS_MPI
#include <mpi.h>
#endif

/* What a launcher has left in the environment. */
typedef struct launch {
    int rank, size;        /* -1: it is not there */
    const char *size_name; /* of the variable that has the size; NULL: none */
} launch;

/* The first of these variables that is set, a number of at least `minimum`. *found (NULL: not wanted) is its name. */
static ca_status read_launched(const char *const names[], int minimum, int *number, const char **found,
                               ca_error *error)
{
    *number = -1;
    for (; *names; names++) {
        const char *text = getenv(*names);
        ca_error reason = {""};
        if (!text || !*text) continue;
        if (found) *found = *names;
        if (ca_value_integer(text, minimum, number, &reason) == CA_OK) return CA_OK;
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%s in the environment: %.900s", *names, reason.message);
    }
    return CA_OK;
}

/* The size is 1 where nobody knows of others. SLURM_STEP_NUM_TASKS counts what srun has started, and is not there in
 * a batch script, as SLURM_NTASKS is; mpirun, which may use srun, tells its own numbers, which count first. */
static ca_status read_launch(launch *l, ca_error *error)
{
    static const char *const numbers[] = {"OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK", NULL};
    static const char *const sizes[] = {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS", NULL};
    static const char *const tasks[] = {"SLURM_PROCID", NULL};
    *l = (launch){0};
    CA_TRY(read_launched(numbers, 0, &l->rank, NULL, error));
    CA_TRY(read_launched(sizes, 1, &l->size, &l->size_name, error));
    if (l->size < 0) l->size = 1;
    if (l->size > 1 && l->rank < 0) CA_TRY(read_launched(tasks, 0, &l->rank, NULL, error));
    return CA_OK;
}

/* What all ranks would say is said once. */
static void silence(void)
{
    const bool silent = freopen("/dev/null", "w", stdout) && freopen("/dev/null", "w", stderr);
    (void)silent; /* without that device everything is said by all */
}

#ifdef CA_HAS_MPI

static ca_ranks ranks;
static bool has_started;

static void send_bytes(void *user, uint32_t to, const void *bytes, size_t size)
{
    (void)user;
    MPI_Send(bytes, (int)size, MPI_BYTE, (int)to, 0, MPI_COMM_WORLD);
}

static bool has_arrived(void *user, uint32_t from, ca_rank_message *message)
{
    MPI_Status status;
    int there = 0, size = 0;
    (void)user;
    MPI_Iprobe(from == CA_ANY_RANK ? MPI_ANY_SOURCE : (int)from, 0, MPI_COMM_WORLD, &there, &status);
    if (!there) return false;
    MPI_Get_count(&status, MPI_BYTE, &size);
    *message = (ca_rank_message){.from = (uint32_t)status.MPI_SOURCE, .size = (size_t)size};
    return true;
}

static void receive_bytes(void *user, const ca_rank_message *message, void *bytes)
{
    (void)user;
    MPI_Recv(bytes, (int)message->size, MPI_BYTE, (int)message->from, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
}

/* The launcher is not of this MPI, or srun has none: the processes have not found each other. */
static ca_status check_found(const launch *l, int size, ca_error *error)
{
    char library[MPI_MAX_LIBRARY_VERSION_STRING];
    int length;
    if (size >= l->size) return CA_OK;
    MPI_Get_library_version(library, &length);
    library[strcspn(library, ",\n")] = '\0';
    return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL,
                   "started as %d processes (%s in the environment), of which MPI has found %d: each would make the "
                   "whole picture, and write the same files. Start them with mpirun of the MPI of this program, "
                   "%.100s, or with srun --mpi=pmix; processes that are to work alone: with env -u %s",
                   l->size, l->size_name, size, library, l->size_name);
}

/* A failure of MPI ends all ranks, with its own message: that is what it does unless it is told otherwise. */
ca_status ca_mpi_start(ca_error *error)
{
    launch l;
    int rank, size, level;
    CA_TRY(read_launch(&l, error));
    if (l.size < 2) return CA_OK;
    if (l.rank > 0) silence();
    MPI_Init_thread(NULL, NULL, MPI_THREAD_FUNNELED, &level);
    has_started = true;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &size);
    CA_TRY(check_found(&l, size, error));
    ranks = (ca_ranks){.rank = (uint32_t)rank,
                       .count = (uint32_t)size,
                       .send = send_bytes,
                       .arrived = has_arrived,
                       .receive = receive_bytes};
    return CA_OK;
}

void ca_mpi_end(void)
{
    fflush(NULL); /* what was said does not wait for the others */
    if (has_started) MPI_Finalize();
}

const ca_ranks *ca_mpi_ranks(void) { return ranks.count > 1 ? &ranks : NULL; }

#else

ca_status ca_mpi_start(ca_error *error)
{
    launch l;
    CA_TRY(read_launch(&l, error));
    if (l.size < 2) return CA_OK;
    if (l.rank > 0) silence();
    return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL,
                   "started as %d processes (%s in the environment), but this program was built without MPI: each "
                   "would make the whole picture, and write the same files. Start one; processes that are to work "
                   "alone: with env -u %s",
                   l.size, l.size_name, l.size_name);
}

void ca_mpi_end(void) {}

const ca_ranks *ca_mpi_ranks(void) { return NULL; }

#endif
