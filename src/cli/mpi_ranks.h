/* MPI: the processes that mpirun or srun has started together, as ranks (render/ranks.h). The one place of that
 * library, which is only used where the program was started so, and need not be there when it is built (CA_MPI).
 *
 * How it was started is told by the environment: OMPI_COMM_WORLD_SIZE (mpirun of OpenMPI), PMI_SIZE (mpiexec of
 * MPICH, srun --mpi=pmi2), SLURM_STEP_NUM_TASKS (srun). */
#ifndef CA_CLI_MPI_RANKS_H
#define CA_CLI_MPI_RANKS_H

#include "render/ranks.h"

/* Begins, where there is more than one process. From then on only rank 0 has standard output and standard error.
 * CA_ERROR_ARGUMENT: a variable of the launcher holds no number, which all processes say.
 * CA_ERROR_UNSUPPORTED: there is, but MPI has not found them all (the launcher belongs to another MPI), or this
 * program was built without it; only rank 0's message is to be told, which is seen to. */
ca_status ca_mpi_start(ca_error *error);
/* Waits for the other processes. Also where there are none. */
void ca_mpi_end(void);

/* NULL: there is one process. */
const ca_ranks *ca_mpi_ranks(void);

#endif
