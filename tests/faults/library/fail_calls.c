/* A library that makes chosen system calls on files under one folder fail.
 *
 * Load it with LD_PRELOAD. It maps the file named by the environment variable FAIL_CALLS, whose
 * layout is `struct control` (written by control.py). Worker processes inherit both variables and
 * map the same file, so calls are counted over all processes.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum operation {
    OPEN = 1 << 0,
    WRITE = 1 << 1,
    PWRITE = 1 << 2,
    CLOSE = 1 << 3,
    FSYNC = 1 << 4,
    RENAME = 1 << 5,
    LINK = 1 << 6,
    FTRUNCATE = 1 << 7,
    FLOCK = 1 << 8,
    UNLINK = 1 << 9,
    MKDIR = 1 << 10,
    READ = 1 << 11,
    CREATE = 1 << 12, /* an open that may create a file */
};

struct control {
    uint32_t operations; /* those that count and fail */
    uint32_t error;      /* errno; 0 for a short write */
    uint32_t nth;        /* the call that fails, from 1; 0 for none */
    uint32_t lasting;    /* whether all later calls fail too */
    uint32_t calls;      /* matching calls so far */
    uint32_t faults;     /* calls that failed so far */
    char folder[1024];   /* absolute, without links and without a slash at its end; "" for none */
    char first[1024];    /* the first call that failed, and its path */
};

static struct control *control;

__attribute__((constructor)) static void map_control(void) {
    const char *name = getenv("FAIL_CALLS");
    if (name == NULL) return;
    int fd = (int)syscall(SYS_openat, AT_FDCWD, name, O_RDWR | O_CLOEXEC, 0);
    if (fd < 0) return;
    void *found = mmap(NULL, sizeof *control, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    syscall(SYS_close, fd);
    if (found != MAP_FAILED) control = found;
}

/* Look up the function of this name in the C library. */
#define REAL(name) \
    static __typeof__(&name) real; \
    if (real == NULL) real = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

enum outcome { PASS, FAIL, SHORT };

static int is_inside(const char *path) {
    size_t length = strlen(control->folder);
    return strncmp(path, control->folder, length) == 0 &&
           (path[length] == '/' || path[length] == '\0' || path[length] == ' ');
}

/* Count a call on a path, and decide whether it fails; then errno is set. */
static enum outcome outcome_of(const char *name, const char *path) {
    if (!is_inside(path)) return PASS;
    uint32_t call = __atomic_add_fetch(&control->calls, 1, __ATOMIC_SEQ_CST);
    if (control->nth == 0 || call < control->nth) return PASS;
    if (call > control->nth && !control->lasting) return PASS;
    if (__atomic_add_fetch(&control->faults, 1, __ATOMIC_SEQ_CST) == 1)
        snprintf(control->first, sizeof control->first, "%s %s", name, path);
    if (control->error == 0) return SHORT;
    errno = (int)control->error;
    return FAIL;
}

static int is_wanted(uint32_t operation) {
    return control != NULL && (control->operations & operation) && control->folder[0] != '\0';
}

/* Write the absolute path of an open file; return whether it has one. */
static int path_of_descriptor(int fd, char *path) {
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, path, PATH_MAX - 1);
    if (length < 0) return 0;
    path[length] = '\0';
    return 1;
}

static enum outcome by_descriptor(const char *name, uint32_t operation, int fd) {
    if (!is_wanted(operation)) return PASS;
    int before = errno;
    char path[PATH_MAX];
    enum outcome found = PASS;
    if (path_of_descriptor(fd, path)) found = outcome_of(name, path);
    if (found != FAIL) errno = before;
    return found;
}

static enum outcome by_path(const char *name, uint32_t operation, int folder, const char *path) {
    if (!is_wanted(operation) || path == NULL) return PASS;
    int before = errno;
    enum outcome found = PASS;
    if (path[0] == '/') {
        found = outcome_of(name, path);
    } else {
        char start[PATH_MAX], whole[2 * PATH_MAX];
        int known = folder == AT_FDCWD ? getcwd(start, sizeof start) != NULL
                                       : path_of_descriptor(folder, start);
        if (known) {
            snprintf(whole, sizeof whole, "%s/%s", start, path);
            found = outcome_of(name, whole);
        }
    }
    if (found != FAIL) errno = before;
    return found;
}

/* open */

static uint32_t kind_of_open(int flags) {
    return flags & O_CREAT ? OPEN | CREATE : OPEN;
}

#define MODE_OF(flags) \
    mode_t mode = 0; \
    if ((flags) & (O_CREAT | O_TMPFILE)) { \
        va_list arguments; \
        va_start(arguments, flags); \
        mode = va_arg(arguments, mode_t); \
        va_end(arguments); \
    }

int open(const char *path, int flags, ...) {
    MODE_OF(flags)
    if (by_path("open", kind_of_open(flags), AT_FDCWD, path) == FAIL) return -1;
    REAL(open);
    return real(path, flags, mode);
}

int open64(const char *path, int flags, ...) {
    MODE_OF(flags)
    if (by_path("open", kind_of_open(flags), AT_FDCWD, path) == FAIL) return -1;
    REAL(open64);
    return real(path, flags, mode);
}

int openat(int folder, const char *path, int flags, ...) {
    MODE_OF(flags)
    if (by_path("openat", kind_of_open(flags), folder, path) == FAIL) return -1;
    REAL(openat);
    return real(folder, path, flags, mode);
}

int openat64(int folder, const char *path, int flags, ...) {
    MODE_OF(flags)
    if (by_path("openat", kind_of_open(flags), folder, path) == FAIL) return -1;
    REAL(openat64);
    return real(folder, path, flags, mode);
}

int creat(const char *path, mode_t mode) {
    if (by_path("creat", OPEN | CREATE, AT_FDCWD, path) == FAIL) return -1;
    REAL(creat);
    return real(path, mode);
}

int creat64(const char *path, mode_t mode) {
    if (by_path("creat", OPEN | CREATE, AT_FDCWD, path) == FAIL) return -1;
    REAL(creat64);
    return real(path, mode);
}

/* Opens through stdio. */
static uint32_t kind_of_stream(const char *mode) {
    return mode[0] == 'r' ? OPEN : OPEN | CREATE;
}

FILE *fopen(const char *path, const char *mode) {
    if (by_path("fopen", kind_of_stream(mode), AT_FDCWD, path) == FAIL) return NULL;
    REAL(fopen);
    return real(path, mode);
}

FILE *fopen64(const char *path, const char *mode) {
    if (by_path("fopen", kind_of_stream(mode), AT_FDCWD, path) == FAIL) return NULL;
    REAL(fopen64);
    return real(path, mode);
}

/* Writes. A short write writes half of the bytes. */

#define HALF(size) ((size) > 1 ? (size) / 2 : (size))

ssize_t write(int fd, const void *data, size_t size) {
    REAL(write);
    enum outcome found = by_descriptor("write", WRITE, fd);
    if (found == FAIL) return -1;
    return real(fd, data, found == SHORT ? HALF(size) : size);
}

ssize_t writev(int fd, const struct iovec *parts, int count) {
    REAL(writev);
    enum outcome found = by_descriptor("writev", WRITE, fd);
    if (found == FAIL) return -1;
    if (found == SHORT) return write(fd, parts[0].iov_base, HALF(parts[0].iov_len));
    return real(fd, parts, count);
}

ssize_t pwrite(int fd, const void *data, size_t size, off_t offset) {
    REAL(pwrite);
    enum outcome found = by_descriptor("pwrite", PWRITE, fd);
    if (found == FAIL) return -1;
    return real(fd, data, found == SHORT ? HALF(size) : size, offset);
}

ssize_t pwrite64(int fd, const void *data, size_t size, off64_t offset) {
    REAL(pwrite64);
    enum outcome found = by_descriptor("pwrite", PWRITE, fd);
    if (found == FAIL) return -1;
    return real(fd, data, found == SHORT ? HALF(size) : size, offset);
}

/* Reads. A short read is allowed at any time, so SHORT reads half of the bytes. */

ssize_t read(int fd, void *data, size_t size) {
    REAL(read);
    enum outcome found = by_descriptor("read", READ, fd);
    if (found == FAIL) return -1;
    return real(fd, data, found == SHORT ? HALF(size) : size);
}

ssize_t pread(int fd, void *data, size_t size, off_t offset) {
    REAL(pread);
    enum outcome found = by_descriptor("pread", READ, fd);
    if (found == FAIL) return -1;
    return real(fd, data, found == SHORT ? HALF(size) : size, offset);
}

ssize_t pread64(int fd, void *data, size_t size, off64_t offset) {
    REAL(pread64);
    enum outcome found = by_descriptor("pread", READ, fd);
    if (found == FAIL) return -1;
    return real(fd, data, found == SHORT ? HALF(size) : size, offset);
}

/* close: the file is closed all the same, as by Linux. */

int close(int fd) {
    REAL(close);
    if (by_descriptor("close", CLOSE, fd) != FAIL) return real(fd);
    int error = errno;
    real(fd);
    errno = error;
    return -1;
}

int fsync(int fd) {
    REAL(fsync);
    return by_descriptor("fsync", FSYNC, fd) == FAIL ? -1 : real(fd);
}

int fdatasync(int fd) {
    REAL(fdatasync);
    return by_descriptor("fdatasync", FSYNC, fd) == FAIL ? -1 : real(fd);
}

int ftruncate(int fd, off_t size) {
    REAL(ftruncate);
    return by_descriptor("ftruncate", FTRUNCATE, fd) == FAIL ? -1 : real(fd, size);
}

int ftruncate64(int fd, off64_t size) {
    REAL(ftruncate64);
    return by_descriptor("ftruncate", FTRUNCATE, fd) == FAIL ? -1 : real(fd, size);
}

int posix_fallocate(int fd, off_t offset, off_t size) {
    REAL(posix_fallocate);
    return by_descriptor("posix_fallocate", FTRUNCATE, fd) == FAIL ? errno : real(fd, offset, size);
}

int posix_fallocate64(int fd, off64_t offset, off64_t size) {
    REAL(posix_fallocate64);
    return by_descriptor("posix_fallocate", FTRUNCATE, fd) == FAIL ? errno : real(fd, offset, size);
}

int flock(int fd, int kind);

int flock(int fd, int kind) {
    REAL(flock);
    return by_descriptor("flock", FLOCK, fd) == FAIL ? -1 : real(fd, kind);
}

/* Names. The path that counts is the old name. */

int rename(const char *old, const char *new) {
    REAL(rename);
    return by_path("rename", RENAME, AT_FDCWD, old) == FAIL ? -1 : real(old, new);
}

int renameat(int from, const char *old, int to, const char *new) {
    REAL(renameat);
    return by_path("renameat", RENAME, from, old) == FAIL ? -1 : real(from, old, to, new);
}

int renameat2(int from, const char *old, int to, const char *new, unsigned int flags) {
    REAL(renameat2);
    return by_path("renameat2", RENAME, from, old) == FAIL ? -1 : real(from, old, to, new, flags);
}

int link(const char *old, const char *new) {
    REAL(link);
    return by_path("link", LINK, AT_FDCWD, old) == FAIL ? -1 : real(old, new);
}

int linkat(int from, const char *old, int to, const char *new, int flags) {
    REAL(linkat);
    return by_path("linkat", LINK, from, old) == FAIL ? -1 : real(from, old, to, new, flags);
}

int unlink(const char *path) {
    REAL(unlink);
    return by_path("unlink", UNLINK, AT_FDCWD, path) == FAIL ? -1 : real(path);
}

int unlinkat(int folder, const char *path, int flags) {
    REAL(unlinkat);
    return by_path("unlinkat", UNLINK, folder, path) == FAIL ? -1 : real(folder, path, flags);
}

int mkdir(const char *path, mode_t mode) {
    REAL(mkdir);
    return by_path("mkdir", MKDIR, AT_FDCWD, path) == FAIL ? -1 : real(path, mode);
}

int mkdirat(int folder, const char *path, mode_t mode) {
    REAL(mkdirat);
    return by_path("mkdirat", MKDIR, folder, path) == FAIL ? -1 : real(folder, path, mode);
}
