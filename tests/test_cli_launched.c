/* The program as one of several processes that a launcher has started and MPI does not connect: what the environment
 * tells is enough for it. Renders by ranks are in test_mpi.sh. */
#define _POSIX_C_SOURCE 200809L
#include "support/program_test.h"

#include <stdlib.h>

/* What a launcher has set, and the variables of others that count for nothing then. */
static void launch(ca_program_result *r, void **state, const char *const variables[][2])
{
    for (int i = 0; i < 3 && variables[i][0]; i++) assert_int_equal(setenv(variables[i][0], variables[i][1], 1), 0);
    RUN(r, "version");
    for (int i = 0; i < 3 && variables[i][0]; i++) assert_int_equal(unsetenv(variables[i][0]), 0);
}

/* Several processes that MPI does not connect would all write the same files. Here the environment tells of others
 * that do not exist, as it is with the launcher of another MPI. One of them says so. */
static void test_processes_that_do_not_find_each_other(void **state)
{
    static const char *const alone[][3][2] = {
        {{"SLURM_NTASKS", "4"}, {"SLURM_PROCID", "0"}},
        {{"SLURM_STEP_NUM_TASKS", "1"}, {"SLURM_NTASKS", "4"}},
        {{"SLURM_STEP_NUM_TASKS", "4"}, {"OMPI_COMM_WORLD_SIZE", "1"}, {"OMPI_COMM_WORLD_RANK", "0"}},
    };
    static const char *const several[][3][2] = {
        {{"OMPI_COMM_WORLD_SIZE", "4"}, {"OMPI_COMM_WORLD_RANK", "0"}},
        {{"PMI_SIZE", "4"}, {"PMI_RANK", "0"}},
        {{"SLURM_STEP_NUM_TASKS", "4"}, {"SLURM_PROCID", "0"}, {"SLURM_NTASKS", "8"}},
        {{"SLURM_STEP_NUM_TASKS", "4"}, {"PMIX_RANK", "0"}, {"SLURM_PROCID", "2"}},
    };
    static const char *const others[][3][2] = {
        {{"OMPI_COMM_WORLD_SIZE", "4"}, {"OMPI_COMM_WORLD_RANK", "1"}},
        {{"PMI_SIZE", "4"}, {"PMI_RANK", "3"}},
        {{"SLURM_STEP_NUM_TASKS", "4"}, {"SLURM_PROCID", "2"}},
    };
    ca_program_result r;
    for (size_t i = 0; i < sizeof alone / sizeof alone[0]; i++) {
        launch(&r, state, alone[i]);
        assert_exit(&r, 0);
        assert_string_equal(r.errors, "");
    }
    for (size_t i = 0; i < sizeof several / sizeof several[0]; i++) {
        char says[256];
        snprintf(says, sizeof says, "caustica: started as 4 processes (%s in the environment), ", several[i][0][0]);
        launch(&r, state, several[i]);
        assert_exit(&r, 1);
        assert_says(r.errors, says);
        assert_says(r.errors, "each would make the whole picture");
        assert_string_equal(r.output, "");
    }
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
        launch(&r, state, others[i]);
        assert_exit(&r, 1);
        assert_string_equal(r.errors, "");
        assert_string_equal(r.output, "");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {PROGRAM_TEST(test_processes_that_do_not_find_each_other)};
    return run_program_tests("processes that a launcher has started", tests, sizeof tests / sizeof tests[0]);
}
