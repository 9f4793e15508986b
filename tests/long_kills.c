/* Two hundred kills at random times over all integrators, each render then going on: the bits of renders without a
 * break; and thirty of renders with --rays auto. CA_KILL_SEED: which times (1). */
#define _POSIX_C_SOURCE 200809L
#include "integrator/integrator.h"
#include "support/program_test.h"
#include "support/random_kills.h"

#include <stdlib.h>

enum { KILLS = 200, KILLS_OF_RAYS = 30 };

static void test_random_kills(void **state)
{
    const char *seed = getenv("CA_KILL_SEED"), *names[CA_MAX_INTEGRATORS];
    ca_test_random random = ca_test_random_seed(seed ? (uint64_t)atoi(seed) : 1);
    int count = 0;
    const ca_kill_job chosen = {"bdpm:radius=0.1", "--spp=600", 0.25, KILLS_OF_RAYS, true};
    for (size_t i = 0; ca_integrator_at(i); i++)
        if (!ca_integrator_has(ca_integrator_at(i), CA_ABILITY_CHOOSES)) names[count++] = ca_integrator_at(i)->name;
    for (int i = 0; i < count; i++) {
        const int kills = KILLS * (i + 1) / count - KILLS * i / count;
        const ca_kill_job job = {names[i], "--spp=36", 0.25, kills, false};
        expect_kills_lose_nothing(*state, &job, &random);
        print_message("    %s: %d kills\n", names[i], kills);
    }
    expect_kills_lose_nothing(*state, &chosen, &random);
}

int main(void)
{
    const struct CMUnitTest tests[] = {PROGRAM_TEST(test_random_kills)};
    return run_program_tests("kills", tests, sizeof tests / sizeof tests[0]);
}
