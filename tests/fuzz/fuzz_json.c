/* Fuzzer of JSON: studies, and their answers. The first byte chooses. */
#define _GNU_SOURCE
#include "cli/study_answers.h"
#include "cli/study_config.h"
#include "memory_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0) return 0;
    const char *path = memory_file(data + 1, size - 1);
    ca_error error = {{0}};
    ca_status status;
    if (data[0] % 2 == 0) {
        ca_study_config config = {0};
        status = ca_study_config_read(path, &config, &error);
        ca_study_config_destroy(&config);
    } else {
        ca_study_answers answers = {0};
        status = ca_study_answers_read(&path, 1, &answers, &error);
        ca_study_answers_destroy(&answers);
    }
    if (status != CA_OK && !error.message[0]) abort();
    return 0;
}
