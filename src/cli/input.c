#include "input.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

int cli_input_open(const char *path, uint64_t most, const char **why) {
    struct stat status;
    const int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (file < 0 || fstat(file, &status) != 0) {
        *why = strerror(errno);
    } else if (S_ISDIR(status.st_mode)) {
        *why = "it is a folder";
    } else if (!S_ISREG(status.st_mode)) {
        *why = "it is no regular file";
    } else if ((uint64_t)status.st_size > most) {
        *why = "it is larger than such a file may be";
    } else {
        return file;
    }
    if (file >= 0) {
        close(file);
    }
    return -1;
}

FILE *cli_input_stream(const char *path, uint64_t most, const char **why) {
    const int file = cli_input_open(path, most, why);
    FILE *stream = file >= 0 ? fdopen(file, "rb") : NULL;
    if (file >= 0 && stream == NULL) {
        *why = strerror(errno);
        close(file);
    }
    return stream;
}
