#include "cli/mpi_ranks.h"

#include "cli/values.h"

#include <stdio.h>
#include <stdlib.h>
#ifdef CA_HAS_MPI
#include <mpi.h>
#endif

/* A number that a launcher has left in the environment, at least `minimum`; -1: it has not. */
static ca_status read_launched(const char *const names[], int minimum, int *number, ca_error *error)
{
    *number = -1;
    for (; *names; names++) {
        const char *text = getenv(*names);
        ca_error reason = {""};
        if (!text || !*text) continue;
        if (ca_value_integer(text, minimum, number, &reason) == CA_OK) return CA_OK;
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%s in the environment: %.900s", *names, reason.message);
    }
    return CA_OK;
}

/* `size`: of processes that were started together; 1: there is one, or nobody knows of others. PMIx has no such
 * variable. */
static ca_status read_launch(int *rank, int *size, ca_error *error)
{
    static const char *const numbers[] = {"OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK", NULL};
    static const char *const sizes[] = {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", NULL};
    static const char *const pmix[] = {"PMIX_RANK", NULL}, *const tasks[] = {"SLURM_STEP_NUM_TASKS", NULL};
    int pmix_rank;
    CA_TRY(read_launched(numbers, 0, rank, error));
    CA_TRY(read_launched(sizes, 1, size, error));
    CA_TRY(read_launched(pmix, 0, &pmix_rank, error));
    if (*size < 0 && pmix_rank >= 0) CA_TRY(read_launched(tasks, 1, size, error));
    if (*size < 0) *size = 1;
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

/* A failure of MPI ends all ranks, with its own message: that is what it does unless it is told otherwise. */
ca_status ca_mpi_start(ca_error *error)
{
    int rank, size, level;
    CA_TRY(read_launch(&rank, &size, error));
    if (size < 2) return CA_OK;
    if (rank > 0) silence();
    MPI_Init_thread(NULL, NULL, MPI_THREAD_FUNNELED, &level);
    has_started = true;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &size);
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
    int rank, size;
    CA_TRY(read_launch(&rank, &size, error));
    if (size < 2) return CA_OK;
    if (rank > 0) silence();
    return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL,
                   "started as %d processes, but this program was built without MPI: they would all make the same "
                   "picture",
                   size);
}

void ca_mpi_end(void) {}

const ca_ranks *ca_mpi_ranks(void) { return NULL; }

#endif
