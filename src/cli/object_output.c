#include "object_output.h"

#include "paths.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

char *cli_object_output(const char *output) {
    const size_t length = strlen(output);
    const char *slash = strrchr(output, '/'), *dot = strrchr(slash != NULL ? slash : output, '.');
    const size_t stem =
        dot != NULL && dot > (slash != NULL ? slash + 1 : output) ? (size_t)(dot - output) : length;
    const bool folder = cli_is_folder(output) || stem == length;
    char *path = malloc(length + sizeof "/.exr" CLI_OBJECT_NAME);
    if (path == NULL) {
        return NULL;
    }
    if (strstr(slash != NULL ? slash : output, CLI_OBJECT_NAME) != NULL) {
        strcpy(path, output);
    } else if (folder) {
        sprintf(path, "%s%s%s.exr", output, output[length - 1] == '/' ? "" : "/", CLI_OBJECT_NAME);
    } else {
        sprintf(path, "%.*s.%s%s", (int)stem, output, CLI_OBJECT_NAME, output + stem);
    }
    return path;
}

char *cli_object_folder(const char *path) {
    const char *slash = strrchr(path, '/');
    const size_t length = slash == NULL || slash == path ? 1 : (size_t)(slash - path);
    return strndup(slash == NULL ? "." : path, length);
}
