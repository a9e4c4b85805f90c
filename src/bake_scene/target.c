#include "bake_scene/target.h"

#include "base/try.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <vdbshade/lit.h>

enum {
    NAME_BYTES = 120 /* of an object's name in a file's, which may have 255 with its number and ending */
};

static const char PLACE[] = "%s"; /* of the object's name in an output */

static vsh_result refuse_memory(vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_MEMORY, "lightmaps: the system refused memory");
}

/* Where the object's name goes; NULL: nowhere. */
static const char *find_place(const char *output) {
    const char *slash = strrchr(output, '/');
    return strstr(slash != NULL ? slash : output, PLACE);
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

/* The output with a name in it, and a number behind the name from the second of its kind on. */
static char *fill(const char *output, const char *name, size_t number) {
    const char *at = find_place(output);
    const size_t size = strlen(output) + strlen(name) + 24;
    char *filled = malloc(size), count[24] = "";
    if (number > 1) {
        snprintf(count, sizeof count, "-%zu", number);
    }
    if (filled != NULL) {
        snprintf(filled, size, "%.*s%s%s%s", (int)(at - output), output, name, count, at + strlen(PLACE));
    }
    return filled;
}

/* Names that differ in case only are one file to some systems. */
static bool is_taken(const vshi_targets *t, const char *path) {
    for (size_t i = 0; i < t->count; ++i) {
        if (strcasecmp(t->list[i].output, path) == 0) {
            return true;
        }
    }
    return false;
}

static char *unique_output(const vshi_targets *t, const char *output, const char *name) {
    char safe[NAME_BYTES + 1];
    make_safe(name[0] != '\0' ? name : "object", safe);
    char *path = fill(output, safe, 1);
    for (size_t number = 2; path != NULL && is_taken(t, path); ++number) {
        free(path);
        path = fill(output, safe, number);
    }
    return path;
}

/* Meshes from `first` on that are one object. */
static size_t object_size(const vsh_mesh *meshes, size_t first, size_t count) {
    size_t end = first + 1;
    while (end < count && meshes[first].object > 0 && meshes[end].object == meshes[first].object) {
        ++end;
    }
    return end - first;
}

/* What casts is known already; what does not is looked at by itself, once for all passes. */
static vsh_result find_solid(vshi_target *target, const vsh_run *run, vsh_error *error) {
    bool known = true;
    for (size_t m = 0; m < target->mesh_count; ++m) {
        known = known && vshi_mesh_sides(&target->meshes[m]) != NULL;
    }
    if (known) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_mesh_set_create(target->meshes, target->mesh_count, &target->set, error));
    target->meshes = target->set.meshes;
    vsh_error why;
    const vsh_result result = vshi_mesh_set_solve(&target->set, run, &why);
    return result == VSH_OK ? VSH_OK : vshi_fail(error, result, "%s: %s", target->receiver.path, why.message);
}

static vsh_result add(vshi_targets *t, const vsh_scene *scene, size_t index, const vsh_mesh *meshes,
                      size_t count, char *output, const vsh_run *run, vsh_error *error) {
    vshi_target *target = &t->list[t->count++];
    *target = (vshi_target){scene->receivers[index], index, meshes, count, output, {NULL}, 0};
    if (output != NULL) {
        target->receiver.output = output;
    }
    if (target->receiver.seams == VSH_SEAMS_DEFAULT) {
        target->receiver.seams = vsh_lit_is_output(target->receiver.output) ? VSH_SEAMS_FIX : VSH_SEAMS_KEEP;
    }
    return find_solid(target, run, error);
}

static vsh_result add_objects(vshi_targets *t, const vsh_scene *scene, size_t index, const vsh_mesh *meshes,
                              size_t count, const vsh_run *run, vsh_error *error) {
    const char *output = scene->receivers[index].output;
    if (find_place(output) == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "receivers[%zu]: output '%s': no '%s' for the names of objects", index, output,
                         PLACE);
    }
    for (size_t i = 0, size; i < count; i += size) {
        size = object_size(meshes, i, count);
        const char *name = meshes[i].object_name != NULL ? meshes[i].object_name : meshes[i].name;
        char *own = unique_output(t, output, name != NULL ? name : "");
        if (own == NULL) {
            return refuse_memory(error);
        }
        VSHI_TRY(add(t, scene, index, meshes + i, size, own, run, error));
    }
    return VSH_OK;
}

char *vshi_page_output(const char *output, size_t page) {
    const char *slash = strrchr(output, '/'), *dot = strrchr(output, '.');
    const size_t length = strlen(output);
    const int stem = (int)(dot != NULL && (slash == NULL || dot > slash) ? (size_t)(dot - output) : length);
    const size_t size = length + 24;
    char *named = malloc(size);
    if (named != NULL) {
        snprintf(named, size, "%.*s.%zu%s", stem, output, page, output + stem);
    }
    return named;
}

/* All pages go into one asset, but images have one each. */
static vsh_result add_pages(vshi_targets *t, const vsh_scene *scene, size_t index, const vsh_assets *assets,
                            const vsh_run *run, vsh_error *error) {
    const vsh_receiver *receiver = &scene->receivers[index];
    const size_t pages = vsh_assets_receiver_pages(assets, index);
    const bool named = pages > 1 && receiver->output != NULL && !vsh_lit_is_output(receiver->output);
    for (size_t page = 0; page < pages; ++page) {
        size_t first, count;
        const vsh_mesh *meshes = vsh_assets_receiver_page(assets, index, page, &first, &count);
        char *output = named ? vshi_page_output(receiver->output, page) : NULL;
        if (named && output == NULL) {
            return refuse_memory(error);
        }
        VSHI_TRY(add(t, scene, index, meshes, count, output, run, error));
        t->list[t->count - 1].page = page;
    }
    return VSH_OK;
}

vsh_result vshi_targets_make(const vsh_scene *scene, const vsh_assets *assets, bool per_object,
                             const vsh_run *run, vshi_targets *targets, vsh_error *error) {
    *targets = (vshi_targets){NULL, 0};
    size_t most = scene->receiver_count;
    for (size_t i = 0; i < scene->receiver_count && per_object; ++i) {
        size_t count;
        vsh_assets_receiver(assets, i, &count);
        most += count;
    }
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        most += vsh_assets_receiver_pages(assets, i);
    }
    targets->list = calloc(most + 1, sizeof *targets->list);
    if (targets->list == NULL) {
        return refuse_memory(error);
    }
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        if (per_object) {
            size_t count;
            const vsh_mesh *meshes = vsh_assets_receiver(assets, i, &count);
            VSHI_TRY(add_objects(targets, scene, i, meshes, count, run, error));
        } else {
            VSHI_TRY(add_pages(targets, scene, i, assets, run, error));
        }
    }
    return VSH_OK;
}

void vshi_targets_free(vshi_targets *targets) {
    for (size_t i = 0; i < targets->count; ++i) {
        vshi_mesh_set_free(&targets->list[i].set);
        free(targets->list[i].output);
    }
    free(targets->list);
    *targets = (vshi_targets){NULL, 0};
}

vsh_image_options vshi_receiver_image(const vsh_receiver *receiver) {
    vsh_image_options options = vsh_image_options_default();
    options.bits = receiver->bits;
    options.pack = receiver->pack;
    options.color_space = receiver->color_space;
    return options;
}
