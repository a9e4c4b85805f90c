#include "targets.h"

#include "message.h"
#include "paths.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum {
    NAME_BYTES = 120 /* of an object's name in a file's, which may have 255 with its number and ending */
};

/* --- names of files */

char *cli_targets_template(const char *output) {
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

char *cli_targets_folder(const char *template) {
    const char *slash = strrchr(template, '/');
    const size_t length = slash == NULL ? 1 : slash == template ? 1 : (size_t)(slash - template);
    return strndup(slash == NULL ? "." : template, length);
}

/* What no file system of Linux, Windows or macOS takes becomes "_". */
static void make_safe(const char *name, char safe[NAME_BYTES + 1]) {
    size_t length = 0;
    for (; name[length] != '\0' && length < NAME_BYTES; ++length) {
        const unsigned char c = (unsigned char)name[length];
        safe[length] = c < 0x20 || c == 0x7f || strchr("/\\:*?\"<>|", c) != NULL ? '_' : name[length];
    }
    while (name[length] != '\0' && length > 0 && ((unsigned char)name[length] & 0xc0) == 0x80) {
        --length; /* no half of a character */
    }
    for (size_t end = length; end > 0 && (safe[end - 1] == ' ' || safe[end - 1] == '.'); --end) {
        safe[end - 1] = '_';
    }
    if (length > 0 && (safe[0] == '.' || safe[0] == ' ')) {
        safe[0] = '_';
    }
    safe[length] = '\0';
}

/* The template with a name in it, and a number behind the name from the second of its kind on. */
static char *fill(const char *path, const char *name, size_t number) {
    const char *slash = strrchr(path, '/'), *at = strstr(slash != NULL ? slash : path, CLI_OBJECT_NAME);
    const size_t size = strlen(path) + strlen(name) + 24;
    char *filled = malloc(size), count[24] = "";
    if (number > 1) {
        snprintf(count, sizeof count, "-%zu", number);
    }
    if (filled != NULL) {
        snprintf(filled, size, "%.*s%s%s%s", (int)(at - path), path, name, count,
                 at + strlen(CLI_OBJECT_NAME));
    }
    return filled;
}

/* Names that differ in case only are one file to some systems. */
static bool is_taken(const cli_targets *t, const char *path) {
    for (size_t i = 0; i < t->scene.receiver_count; ++i) {
        if (strcasecmp(t->outputs[i], path) == 0) {
            return true;
        }
    }
    return false;
}

static char *unique_output(const cli_targets *t, const char *template, const char *name) {
    char safe[NAME_BYTES + 1];
    make_safe(name[0] != '\0' ? name : "object", safe);
    char *path = fill(template, safe, 1);
    for (size_t number = 2; path != NULL && is_taken(t, path); ++number) {
        free(path);
        path = fill(template, safe, number);
    }
    return path;
}

/* --- lightmaps */

/* Meshes from `first` on that are one object. */
static size_t object_size(const vsh_mesh *meshes, size_t first, size_t count) {
    size_t end = first + 1;
    while (end < count && meshes[first].object > 0 && meshes[end].object == meshes[first].object) {
        ++end;
    }
    return end - first;
}

static int allocate(cli_targets *t, size_t most) {
    t->meshes = calloc(most, sizeof *t->meshes);
    t->mesh_counts = calloc(most, sizeof *t->mesh_counts);
    t->receivers = calloc(most, sizeof *t->receivers);
    t->outputs = calloc(most, sizeof *t->outputs);
    return t->meshes != NULL && t->mesh_counts != NULL && t->receivers != NULL && t->outputs != NULL
               ? CLI_OK
               : cli_out_of_memory("lightmaps");
}

static void add(cli_targets *t, const vsh_receiver *receiver, const vsh_mesh *meshes, size_t count) {
    const size_t at = t->scene.receiver_count++;
    t->meshes[at] = meshes;
    t->mesh_counts[at] = count;
    t->receivers[at] = *receiver;
}

static int add_objects(cli_targets *t, const vsh_receiver *receiver, const vsh_mesh *meshes, size_t count) {
    for (size_t i = 0, size; i < count; i += size) {
        size = object_size(meshes, i, count);
        const char *name = meshes[i].object_name != NULL ? meshes[i].object_name : meshes[i].name;
        char *output = unique_output(t, receiver->output, name != NULL ? name : "");
        if (output == NULL) {
            return cli_out_of_memory("lightmaps");
        }
        t->outputs[t->scene.receiver_count] = output;
        vsh_receiver own = *receiver;
        own.output = output;
        add(t, &own, meshes + i, size);
    }
    return CLI_OK;
}

int cli_targets_make(const vsh_scene *scene, const vsh_assets *assets, bool per_object,
                     cli_targets *targets) {
    *targets = (cli_targets){.scene = *scene};
    targets->scene.receiver_count = 0;
    size_t most = scene->receiver_count;
    for (size_t i = 0; i < scene->receiver_count && per_object; ++i) {
        size_t count;
        vsh_assets_receiver(assets, i, &count);
        most += count;
    }
    int code = allocate(targets, most);
    for (size_t i = 0; i < scene->receiver_count && code == CLI_OK; ++i) {
        size_t count;
        const vsh_mesh *meshes = vsh_assets_receiver(assets, i, &count);
        if (per_object) {
            code = add_objects(targets, &scene->receivers[i], meshes, count);
        } else {
            add(targets, &scene->receivers[i], meshes, count);
        }
    }
    targets->scene.receivers = targets->receivers;
    return code;
}

void cli_targets_free(cli_targets *t) {
    for (size_t i = 0; t->outputs != NULL && i < t->scene.receiver_count; ++i) {
        free(t->outputs[i]);
    }
    free(t->outputs);
    free(t->receivers);
    free(t->mesh_counts);
    free(t->meshes);
    *t = (cli_targets){0};
}
