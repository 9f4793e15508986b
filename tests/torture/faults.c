/* A library to preload (LD_PRELOAD): the n-th call that can fail does fail, once or from then on.
 *
 * CA_FAULT_KIND: "own" (memory that the program's own code asks for, for itself or for a library that was given its
 * functions), "foreign" (memory that libraries ask for by themselves), "file" (open, openat, opendir, access, stat,
 * fstat, fchmod, readlink, flock, read, write, lseek, fsync, close, rename, mkdir, mkstemp), "thread" (threads of the
 * program's own), "foreign-thread" (of its libraries), "monitor" (Embree asks the program's memory monitor, which
 * says no).
 * CA_FAULT_AT: n, counted from 1; 0: none fails. CA_FAULT_STAYS=1: all after it fail, too.
 * CA_FAULT_REPORT: a file for what happened. Without a fault, a line for each call: a hash of its call stack; the
 * number of the line is the call's. With one, the line "failed CALL" for each of the first calls that fail, then a
 * line for each function on the stack, the innermost first: its library and its name, where there is one.
 *
 * Counting begins when this library is loaded. The C library's streams read and write inside of it, where nothing can
 * be put between: streams that are made with fdopen and fopen are replaced by streams whose functions are here. */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <execinfo.h>
#include <fcntl.h>
#include <link.h>
#include <malloc.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

typedef enum fault_kind { KIND_NONE, OWN, FOREIGN, FILES, THREAD, MONITOR, FOREIGN_THREAD } fault_kind;

static const char *const kind_names[] = {"", "own", "foreign", "file", "thread", "monitor", "foreign-thread"};

enum {
    MOST_FRAMES = 64,
    INNERMOST = 12 /* functions that tell call stacks apart */,
    MOST_STREAMS = 64,
    MOST_REPORTS = 500
};

static struct {
    fault_kind kind;
    long at;
    bool stays;
    int report; /* descriptor; -1: none */
    atomic_bool counts;
    atomic_long count;
    uintptr_t program_begin, program_end; /* of its code */
} faults = {.report = -1};

static _Thread_local bool inside; /* of what a fault itself calls */

/* ---- The functions that are replaced --------------------------------------------------------------------------- */

extern void *__libc_malloc(size_t);
extern void *__libc_calloc(size_t, size_t);
extern void *__libc_realloc(void *, size_t);
extern void *__libc_memalign(size_t, size_t);

static void *(*real_mmap)(void *, size_t, int, int, int, off_t);
static int (*real_open)(const char *, int, ...);
static int (*real_openat)(int, const char *, int, ...);
static DIR *(*real_opendir)(const char *);
static int (*real_stat)(const char *, struct stat *);
static int (*real_fstat)(int, struct stat *);
static int (*real_fchmod)(int, mode_t);
static int (*real_access)(const char *, int);
static ssize_t (*real_readlink)(const char *, char *, size_t);
static int (*real_flock)(int, int);
static int (*real_close)(int);
static int (*real_fsync)(int);
static int (*real_rename)(const char *, const char *);
static int (*real_mkdir)(const char *, mode_t);
static int (*real_mkstemp)(char *);
static int (*real_fileno)(FILE *);
static int (*real_pthread_create)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);
static FILE *(*real_fopen)(const char *, const char *);
static FILE *(*real_fdopen)(int, const char *);

static void find(const char *name, void *function)
{
    void *found = dlsym(RTLD_NEXT, name);
    memcpy(function, &found, sizeof found);
}

/* Libraries call some of them before this one is initialised. */
#define REAL(name) (*(real_##name ? real_##name : (find(#name, &real_##name), real_##name)))

/* ---- Start ----------------------------------------------------------------------------------------------------- */

/* The first object that is loaded is the program. */
static int keep_program(struct dl_phdr_info *info, size_t size, void *user)
{
    (void)size;
    (void)user;
    for (int i = 0; i < info->dlpi_phnum; i++) {
        const ElfW(Phdr) *header = &info->dlpi_phdr[i];
        if (header->p_type != PT_LOAD || !(header->p_flags & PF_X)) continue;
        faults.program_begin = info->dlpi_addr + header->p_vaddr;
        faults.program_end = faults.program_begin + header->p_memsz;
    }
    return 1;
}

__attribute__((constructor)) static void start(void)
{
    const char *kind = getenv("CA_FAULT_KIND"), *at = getenv("CA_FAULT_AT"), *stays = getenv("CA_FAULT_STAYS");
    const char *report = getenv("CA_FAULT_REPORT");
    void *frames[MOST_FRAMES];
    for (int i = OWN; kind && i <= FOREIGN_THREAD; i++)
        if (strcmp(kind, kind_names[i]) == 0) faults.kind = (fault_kind)i;
    if (faults.kind == KIND_NONE) return;
    dl_iterate_phdr(keep_program, NULL);
    (void)backtrace(frames, MOST_FRAMES); /* the first one loads a library */
    faults.at = at ? atol(at) : 0;
    faults.stays = stays && stays[0] == '1';
    if (report) faults.report = REAL(open)(report, O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0666);
    atomic_store(&faults.counts, true);
}

/* ---- Counting -------------------------------------------------------------------------------------------------- */

static bool is_program(const void *address)
{
    return (uintptr_t)address >= faults.program_begin && (uintptr_t)address < faults.program_end;
}

static void report_stack(void)
{
    void *frames[MOST_FRAMES];
    char line[32];
    uint64_t hash = 14695981039346656037u;
    const int count = backtrace(frames, MOST_FRAMES);
    for (int i = 0; i < count && i < INNERMOST; i++) hash = (hash ^ (uintptr_t)frames[i]) * 1099511628211u;
    const int length = snprintf(line, sizeof line, "%016llx\n", (unsigned long long)hash);
    if (write(faults.report, line, (size_t)length) != length) abort();
}

static void report_failure(const char *call)
{
    void *frames[MOST_FRAMES];
    char line[1024];
    int length = snprintf(line, sizeof line, "failed %s\n", call);
    if (write(faults.report, line, (size_t)length) != length) abort();
    const int count = backtrace(frames, MOST_FRAMES);
    for (int i = 0; i < count; i++) {
        Dl_info info = {0};
        if (!dladdr(frames[i], &info) || !info.dli_fname) continue;
        const char *slash = strrchr(info.dli_fname, '/');
        length = snprintf(line, sizeof line, "%s %s\n", slash ? slash + 1 : info.dli_fname,
                          info.dli_sname ? info.dli_sname : "-");
        if (write(faults.report, line, (size_t)length) != length) abort();
    }
}

/* Is this the call that fails, or one after it? */
static bool fails(fault_kind kind, const char *call)
{
    if (kind != faults.kind || inside || !atomic_load(&faults.counts)) return false;
    const long number = atomic_fetch_add(&faults.count, 1) + 1;
    const bool failed = faults.at > 0 && (number == faults.at || (faults.stays && number > faults.at));
    inside = true;
    if (faults.report >= 0 && faults.at == 0) report_stack();
    if (faults.report >= 0 && failed && number < faults.at + MOST_REPORTS) report_failure(call);
    inside = false;
    return failed;
}

static bool file_fails(const char *call)
{
    if (!fails(FILES, call)) return false;
    errno = EIO;
    return true;
}

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

static bool memory_fails(const char *call, const void *caller)
{
    if (!fails(is_program(caller) ? OWN : FOREIGN, call)) return false;
    errno = ENOMEM;
    return true;
}

#define CALLER __builtin_return_address(0)

void *malloc(size_t size) { return memory_fails("malloc", CALLER) ? NULL : __libc_malloc(size); }

void *calloc(size_t count, size_t size) { return memory_fails("calloc", CALLER) ? NULL : __libc_calloc(count, size); }

void *realloc(void *memory, size_t size)
{
    return memory_fails("realloc", CALLER) ? NULL : __libc_realloc(memory, size);
}

void *aligned_alloc(size_t alignment, size_t size)
{
    return memory_fails("aligned_alloc", CALLER) ? NULL : __libc_memalign(alignment, size);
}

void *memalign(size_t alignment, size_t size)
{
    return memory_fails("memalign", CALLER) ? NULL : __libc_memalign(alignment, size);
}

int posix_memalign(void **memory, size_t alignment, size_t size)
{
    if (memory_fails("posix_memalign", CALLER)) return ENOMEM;
    *memory = __libc_memalign(alignment, size);
    return *memory ? 0 : ENOMEM;
}

void *mmap(void *address, size_t size, int access, int flags, int descriptor, off_t offset)
{
    if (memory_fails("mmap", CALLER)) return MAP_FAILED;
    return REAL(mmap)(address, size, access, flags, descriptor, offset);
}

/* ---- Threads --------------------------------------------------------------------------------------------------- */

int pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*function)(void *), void *user)
{
    if (fails(is_program(CALLER) ? THREAD : FOREIGN_THREAD, "pthread_create")) return EAGAIN;
    return REAL(pthread_create)(thread, attributes, function, user);
}

/* ---- Embree's memory monitor ----------------------------------------------------------------------------------- */

typedef bool (*monitor_function)(void *user, ssize_t bytes, bool post);

static monitor_function program_monitor;

static bool monitor(void *user, ssize_t bytes, bool post)
{
    if (bytes > 0 && fails(MONITOR, "monitor")) return false;
    return program_monitor(user, bytes, post);
}

void rtcSetDeviceMemoryMonitorFunction(void *device, monitor_function function, void *user);
void rtcSetDeviceMemoryMonitorFunction(void *device, monitor_function function, void *user)
{
    void (*real_set)(void *, monitor_function, void *);
    find("rtcSetDeviceMemoryMonitorFunction", &real_set);
    program_monitor = function;
    real_set(device, faults.kind == MONITOR ? monitor : function, user);
}

/* ---- Files ----------------------------------------------------------------------------------------------------- */

static int open_file(const char *path, int flags, mode_t mode)
{
    return file_fails("open") ? -1 : REAL(open)(path, flags, mode);
}

#define MODE_OF(flags, mode)                                                                                         \
    mode_t mode = 0;                                                                                                 \
    if ((flags) & (O_CREAT | O_TMPFILE)) {                                                                           \
        va_list list;                                                                                                \
        va_start(list, flags);                                                                                       \
        mode = va_arg(list, mode_t);                                                                                 \
        va_end(list);                                                                                                \
    }

int open(const char *path, int flags, ...)
{
    MODE_OF(flags, mode)
    return open_file(path, flags, mode);
}

int open64(const char *path, int flags, ...)
{
    MODE_OF(flags, mode)
    return open_file(path, flags, mode);
}

int openat(int folder, const char *path, int flags, ...)
{
    MODE_OF(flags, mode)
    return file_fails("openat") ? -1 : REAL(openat)(folder, path, flags, mode);
}

DIR *opendir(const char *path) { return file_fails("opendir") ? NULL : REAL(opendir)(path); }
int stat(const char *path, struct stat *info) { return file_fails("stat") ? -1 : REAL(stat)(path, info); }
int fstat(int descriptor, struct stat *info) { return file_fails("fstat") ? -1 : REAL(fstat)(descriptor, info); }
int fchmod(int descriptor, mode_t mode) { return file_fails("fchmod") ? -1 : REAL(fchmod)(descriptor, mode); }
int access(const char *path, int mode) { return file_fails("access") ? -1 : REAL(access)(path, mode); }

ssize_t readlink(const char *path, char *target, size_t size)
{
    return file_fails("readlink") ? -1 : REAL(readlink)(path, target, size);
}

int flock(int descriptor, int operation) { return file_fails("flock") ? -1 : REAL(flock)(descriptor, operation); }

/* One that fails has closed it, as on Linux. */
int close(int descriptor)
{
    const bool failed = file_fails("close");
    const int result = REAL(close)(descriptor);
    if (failed) errno = EIO;
    return failed ? -1 : result;
}

int fsync(int descriptor) { return file_fails("fsync") ? -1 : REAL(fsync)(descriptor); }
int rename(const char *from, const char *to) { return file_fails("rename") ? -1 : REAL(rename)(from, to); }
int mkdir(const char *path, mode_t mode) { return file_fails("mkdir") ? -1 : REAL(mkdir)(path, mode); }
int mkstemp(char *name) { return file_fails("mkstemp") ? -1 : REAL(mkstemp)(name); }

/* ---- Streams --------------------------------------------------------------------------------------------------- */

typedef struct stream_of {
    FILE *stream;
    int descriptor;
} stream_of;

static stream_of streams[MOST_STREAMS];
static pthread_mutex_t streams_lock = PTHREAD_MUTEX_INITIALIZER;

static ssize_t cookie_read(void *cookie, char *bytes, size_t size)
{
    const stream_of *s = cookie;
    return file_fails("read") ? -1 : read(s->descriptor, bytes, size);
}

/* Such a stream takes 0 for an error. */
static ssize_t cookie_write(void *cookie, const char *bytes, size_t size)
{
    const stream_of *s = cookie;
    if (file_fails("write")) return 0;
    const ssize_t written = write(s->descriptor, bytes, size);
    return written < 0 ? 0 : written;
}

static int cookie_seek(void *cookie, off64_t *offset, int from)
{
    const stream_of *s = cookie;
    const off64_t place = file_fails("lseek") ? -1 : lseek64(s->descriptor, *offset, from);
    if (place < 0) return -1;
    *offset = place;
    return 0;
}

static int cookie_close(void *cookie)
{
    stream_of *s = cookie;
    const int descriptor = s->descriptor;
    pthread_mutex_lock(&streams_lock);
    *s = (stream_of){NULL, -1};
    pthread_mutex_unlock(&streams_lock);
    return close(descriptor);
}

static FILE *stream_on(int descriptor, const char *mode)
{
    const cookie_io_functions_t functions = {cookie_read, cookie_write, cookie_seek, cookie_close};
    stream_of *s = NULL;
    pthread_mutex_lock(&streams_lock);
    for (int i = 0; !s && i < MOST_STREAMS; i++)
        if (!streams[i].stream) s = &streams[i];
    FILE *stream = s ? fopencookie(s, mode, functions) : NULL;
    if (stream) *s = (stream_of){stream, descriptor};
    pthread_mutex_unlock(&streams_lock);
    return stream;
}

FILE *fdopen(int descriptor, const char *mode)
{
    return faults.kind == FILES ? stream_on(descriptor, mode) : REAL(fdopen)(descriptor, mode);
}

FILE *fopen(const char *path, const char *mode)
{
    if (faults.kind != FILES || mode[0] != 'r') return REAL(fopen)(path, mode);
    const int descriptor = open_file(path, O_RDONLY | O_CLOEXEC, 0);
    return descriptor < 0 ? NULL : stream_on(descriptor, mode);
}

int fileno(FILE *stream)
{
    for (int i = 0; i < MOST_STREAMS; i++)
        if (streams[i].stream == stream) return streams[i].descriptor;
    return REAL(fileno)(stream);
}
