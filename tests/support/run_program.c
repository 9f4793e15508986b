#define _GNU_SOURCE
#include "support/run_program.h"

#include <fcntl.h>
#include <ftw.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

enum { WORD_LIMIT = 32 };

bool ca_program_open(ca_program *program, const char *built)
{
    const char *chosen = getenv("CAUSTICA_PROGRAM");
    program->path = chosen ? chosen : built;
    if (access(program->path, X_OK) != 0) return false;
    strcpy(program->folder, "/tmp/caustica-test-XXXXXX");
    if (!mkdtemp(program->folder)) fail_msg("no folder for the test");
    return true;
}

static int remove_one(const char *path, const struct stat *info, int kind, struct FTW *place)
{
    (void)info;
    (void)kind;
    (void)place;
    return remove(path);
}

void ca_program_close(ca_program *program) { nftw(program->folder, remove_one, 8, FTW_DEPTH | FTW_PHYS); }

static void redirect(const char *file, int target)
{
    const int descriptor = open(file, O_CREAT | O_TRUNC | O_WRONLY, 0666);
    if (descriptor < 0 || dup2(descriptor, target) < 0) _exit(126);
    close(descriptor);
}

pid_t ca_program_start(const ca_program *program, const char *const words[], int error_descriptor)
{
    char *arguments[WORD_LIMIT + 2] = {(char *)(uintptr_t)program->path}; /* exec wants no const, and only reads */
    int count = 1;
    for (; words[count - 1] && count <= WORD_LIMIT; count++) arguments[count] = (char *)(uintptr_t)words[count - 1];
    const pid_t process = fork();
    if (process < 0) fail_msg("cannot fork");
    if (process > 0) return process;
    if (chdir(program->folder) != 0) _exit(126);
    redirect(".stdout", STDOUT_FILENO);
    if (error_descriptor < 0)
        redirect(".stderr", STDERR_FILENO);
    else if (dup2(error_descriptor, STDERR_FILENO) < 0)
        _exit(126);
    execv(program->path, arguments);
    _exit(127);
}

static void read_text(const char *folder, const char *name, char *text, size_t size)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "rb");
    const size_t length = file ? fread(text, 1, size - 1, file) : 0;
    text[length] = '\0';
    if (file) fclose(file);
}

void ca_program_finish(const ca_program *program, pid_t process, ca_program_result *result)
{
    int status = 0;
    if (waitpid(process, &status, 0) != process) fail_msg("cannot wait for the program");
    result->exit_status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    result->signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    read_text(program->folder, ".stdout", result->output, sizeof result->output);
    read_text(program->folder, ".stderr", result->errors, sizeof result->errors);
}

void ca_program_wait_for(const ca_program *program, const char *name)
{
    const struct timespec pause = {.tv_nsec = 5000000};
    char path[256];
    snprintf(path, sizeof path, "%s/%s", program->folder, name);
    for (int i = 0; i < 4000 && access(path, F_OK) != 0; i++) nanosleep(&pause, NULL);
    if (access(path, F_OK) != 0) fail_msg("%s does not come", name);
}

void ca_program_run(const ca_program *program, const char *const words[], ca_program_result *result)
{
    ca_program_finish(program, ca_program_start(program, words, -1), result);
}
