/* Texts that are damaged at random, and readers of scenes that must bear them: a mutated scene either imports or
 * fails with a message, in time, without a crash and (under the address sanitizer) without a leak.
 *
 * Mutation i depends on i alone. CAUSTICA_MUTATIONS is the number of mutations, CAUSTICA_MUTATIONS_FIRST the first i,
 * so that a failure can be found again. */
#ifndef CA_TESTS_SUPPORT_MUTATED_TEXT_H
#define CA_TESTS_SUPPORT_MUTATED_TEXT_H

#include "import/import.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { MUTATED_TEXT_MAX = 1 << 16 };

typedef struct mutated_text {
    char bytes[MUTATED_TEXT_MAX];
    size_t size;
} mutated_text;

/* A number below the limit, 0 where that is 0. */
size_t mutation_below(uint64_t *random, size_t limit);

/* Nothing where the text would get too long. */
void mutated_replace(mutated_text *t, size_t at, size_t removed, const char *inserted, size_t count);

/* Changes for texts of any kind; the text is not empty. */
typedef void (*mutation)(mutated_text *t, uint64_t *random);
void mutation_flip_byte(mutated_text *t, uint64_t *random);
void mutation_cut(mutated_text *t, uint64_t *random);
void mutation_repeat_piece(mutated_text *t, uint64_t *random);

/* One to three of these. */
void mutate(mutated_text *t, uint64_t *random, const mutation *kinds, size_t kind_count);

/* CAUSTICA_MUTATIONS and the like. */
long mutation_setting(const char *name, long fallback);

/* Is the damaged scene still one? Fails the test where that takes long or has no message. */
bool mutation_imports(const ca_scene_source *source, long number);

/* A hundred thousand mutations of the scenes that two patterns of the source folder find. */
void mutated_scenes_run(const char *const patterns[2], const mutation *kinds, size_t kind_count);

#endif
