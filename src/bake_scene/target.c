#include "bake_scene/target.h"

#include "base/try.h"
#include "base/utf8.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <vdbshade/lit.h>

enum {
    MOST_LIT_PAGES = 65534, /* that materials are told apart by */
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

/* What no file system of Linux, Windows or macOS takes becomes "_", and so do bytes that are no UTF-8. */
static void make_safe(const char *name, char safe[NAME_BYTES + 1]) {
    size_t length = 0;
    for (size_t whole = 0; name[length] != '\0' && length < NAME_BYTES; ++length) {
        const unsigned char c = (unsigned char)name[length];
        whole = whole > 0 ? whole : vshi_utf8_length(name + length);
        safe[length] =
            whole == 0 || c < 0x20 || c == 0x7f || strchr("/\\:*?\"<>|", c) != NULL ? '_' : name[length];
        whole -= whole > 0;
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

static vsh_result finish(vshi_target *target, const vsh_run *run, vsh_error *error) {
    if (target->receiver.seams == VSH_SEAMS_DEFAULT) {
        target->receiver.seams = vsh_lit_is_output(target->receiver.output) ? VSH_SEAMS_FIX : VSH_SEAMS_KEEP;
    }
    return find_solid(target, run, error);
}

/* FILE.MARK.exr for FILE.exr. */
static char *mark_output(const char *output, const char *mark) {
    const char *slash = strrchr(output, '/'), *dot = strrchr(output, '.');
    const size_t length = strlen(output);
    const int stem = (int)(dot != NULL && (slash == NULL || dot > slash) ? (size_t)(dot - output) : length);
    const size_t size = length + strlen(mark) + 2;
    char *marked = malloc(size);
    if (marked != NULL) {
        snprintf(marked, size, "%.*s.%s%s", stem, output, mark, output + stem);
    }
    return marked;
}

char *vshi_object_output(const char *output, const char *object) {
    const char *at = find_place(output);
    if (at == NULL) {
        return mark_output(output, object);
    }
    const size_t size = strlen(output) + strlen(object) + 1;
    char *filled = malloc(size);
    if (filled != NULL) {
        snprintf(filled, size, "%.*s%s%s", (int)(at - output), output, object, at + strlen(PLACE));
    }
    return filled;
}

char *vshi_page_output(const char *output, size_t page) {
    char number[24];
    snprintf(number, sizeof number, "%zu", page);
    return mark_output(output, number);
}

char *vshi_target_file(const vshi_target *target, size_t pages, const char *file) {
    return target->object != NULL ? vshi_object_output(file, target->object)
           : pages > 1            ? vshi_page_output(file, target->page)
                                  : strdup(file);
}

/* --- names of objects */

/* Whether two lightmaps of one name would be one file: images of one output, pages of one asset. */
static bool are_together(const vshi_target *a, const vshi_target *b, const vsh_scene *scene) {
    const char *x = scene->receivers[a->index].output, *y = scene->receivers[b->index].output;
    return a->index == b->index || (x != NULL && y != NULL && strcasecmp(x, y) == 0);
}

/* Whether `name` is `base`, or that with a number behind it. Names that differ in case only are one file to
 * some systems. */
static bool is_numbered(const char *name, const char *base) {
    const size_t length = strlen(base);
    return strncasecmp(name, base, length) == 0 &&
           (name[length] == '\0' ||
            (name[length] == '-' && name[length + 1 + strspn(name + length + 1, "0123456789")] == '\0'));
}

/* Which of the lightmaps before the last one are in its way. `base`: count those with a number, too. */
static size_t count_taken(const vshi_targets *t, const vsh_scene *scene, const char *name, bool base) {
    const vshi_target *own = &t->list[t->count - 1];
    size_t count = 0;
    for (size_t i = 0; i + 1 < t->count; ++i) {
        const vshi_target *other = &t->list[i];
        count += other->object != NULL && are_together(own, other, scene) &&
                 (base ? is_numbered(other->object, name) : strcasecmp(other->object, name) == 0);
    }
    return count;
}

/* The object's name in files of the last lightmap, with a number behind it from the second of its kind on; to
 * be freed. */
static char *unique_name(const vshi_targets *t, const vsh_scene *scene, const char *name) {
    char safe[NAME_BYTES + 1], unique[NAME_BYTES + 24];
    make_safe(name[0] != '\0' ? name : "object", safe);
    snprintf(unique, sizeof unique, "%s", safe);
    if (count_taken(t, scene, unique, false) > 0) {
        size_t number = count_taken(t, scene, safe, true);
        do {
            snprintf(unique, sizeof unique, "%s-%zu", safe, ++number);
        } while (count_taken(t, scene, unique, false) > 0);
    }
    return strdup(unique);
}

/* --- lightmaps */

/* All pages go into one asset, but images have one each: of an object with its name, else with a number. */
static vsh_result add_pages(vshi_targets *t, const vsh_scene *scene, size_t index, const vsh_assets *assets,
                            const vsh_run *run, vsh_error *error) {
    const vsh_receiver *receiver = &scene->receivers[index];
    const size_t pages = vsh_assets_receiver_pages(assets, index), *numbers;
    const bool unwrapped = vsh_assets_receiver_atlas(assets, index, &numbers) != NULL;
    const bool image = receiver->output != NULL && !vsh_lit_is_output(receiver->output);
    for (size_t page = 0; page < pages; ++page) {
        size_t first, count;
        vsh_receiver_page info;
        vsh_assets_receiver_page_info(assets, index, page, &info);
        const vsh_mesh *meshes = vsh_assets_receiver_page(assets, index, page, &first, &count);
        vshi_target *target = &t->list[t->count];
        const bool own = info.object != NULL, named = image && (own || pages > 1);
        *target = (vshi_target){.receiver = *receiver, .index = index, .page = page, .unwrapped = unwrapped};
        ++t->count;
        target->receiver.width = info.width;
        target->receiver.height = info.height;
        target->meshes = meshes;
        target->mesh_count = count;
        if (own) {
            target->object = unique_name(t, scene, info.object);
        }
        if (named) {
            target->output = own && target->object != NULL
                                 ? vshi_object_output(receiver->output, target->object)
                                 : vshi_page_output(receiver->output, page);
            target->receiver.output = target->output;
        }
        if (vsh_lit_is_output(receiver->output) && page >= MOST_LIT_PAGES) {
            return vshi_fail(error, VSH_ERROR_LIMIT, "%s: %zu lightmaps, an asset has at most %d",
                             receiver->output, pages, MOST_LIT_PAGES);
        }
        if ((own && target->object == NULL) || (named && target->output == NULL)) {
            return refuse_memory(error);
        }
        VSHI_TRY(finish(target, run, error));
    }
    return VSH_OK;
}

vsh_result vshi_targets_make(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                             vshi_targets *targets, vsh_error *error) {
    *targets = (vshi_targets){NULL, 0};
    size_t most = 0;
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        most += vsh_assets_receiver_pages(assets, i);
    }
    targets->list = calloc(most + 1, sizeof *targets->list);
    if (targets->list == NULL) {
        return refuse_memory(error);
    }
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        VSHI_TRY(add_pages(targets, scene, i, assets, run, error));
    }
    return VSH_OK;
}

void vshi_targets_free(vshi_targets *targets) {
    for (size_t i = 0; i < targets->count; ++i) {
        vshi_mesh_set_free(&targets->list[i].set);
        free(targets->list[i].output);
        free(targets->list[i].object);
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
