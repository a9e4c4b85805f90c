/* The lightmaps of a job, and the names of their files and of its parts. */
#include "bake_scene/parts.h"

#include "base/utf8.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>
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

/* FILE.OBJECT.exr for FILE.exr, or with the object's name in place of "%s". */
static char *object_output(const char *output, const char *object) {
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

/* FILE.PAGE.exr for FILE.exr. */
static char *page_output(const char *output, size_t page) {
    char number[24];
    snprintf(number, sizeof number, "%zu", page);
    return mark_output(output, number);
}

char *vshi_target_file(const vshi_target *target, size_t pages, const char *file) {
    return target->object != NULL ? object_output(file, target->object)
           : pages > 1            ? page_output(file, target->page)
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
    const bool lit = vsh_lit_is_output(receiver->output) != 0;
    if (lit && pages > MOST_LIT_PAGES) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: %zu lightmaps, an asset has at most %d",
                         receiver->output, pages, MOST_LIT_PAGES);
    }
    for (size_t page = 0; page < pages; ++page) {
        size_t first;
        vsh_receiver_page info;
        vshi_target *target = &t->list[t->count++];
        vsh_assets_receiver_page_info(assets, index, page, &info);
        *target = (vshi_target){.receiver = *receiver, .index = index, .page = page, .unwrapped = unwrapped};
        target->receiver.width = info.width;
        target->receiver.height = info.height;
        target->meshes = vsh_assets_receiver_page(assets, index, page, &first, &target->mesh_count);
        target->object = info.object != NULL ? unique_name(t, scene, info.object) : NULL;
        target->output = receiver->output != NULL ? vshi_target_file(target, pages, receiver->output) : NULL;
        if ((info.object != NULL && target->object == NULL) ||
            (receiver->output != NULL && target->output == NULL)) {
            return refuse_memory(error);
        }
        target->receiver.output = lit ? receiver->output : target->output;
        if (receiver->seams == VSH_SEAMS_DEFAULT) {
            target->receiver.seams = lit ? VSH_SEAMS_FIX : VSH_SEAMS_KEEP;
        }
        VSHI_TRY(find_solid(target, run, error));
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

/* --- files of parts */

enum { MOST_NAMED = 6 }; /* parts that are missing */

char *vshi_part_path(const char *parts, int32_t shard, int32_t count) {
    static const char *const form = "%s.%d-of-%d.part";
    const int length = snprintf(NULL, 0, form, parts, shard, count);
    char *path = length > 0 ? malloc((size_t)length + 1) : NULL;
    if (path != NULL) {
        snprintf(path, (size_t)length + 1, form, parts, shard, count);
    }
    return path;
}

/* N of "NAME.I-of-N.part"; 0: it is no such name. */
static int32_t count_of_name(const char *entry, const char *name) {
    const size_t length = strlen(name);
    int shard = 0, count = 0, used = 0;
    if (strncmp(entry, name, length) != 0 || entry[length] != '.' ||
        sscanf(entry + length, ".%5d-of-%5d.part%n", &shard, &count, &used) != 2 || used == 0 ||
        entry[length + (size_t)used] != '\0') {
        return 0;
    }
    return shard >= 1 && shard <= count && count <= VSHI_MOST_SHARDS ? count : 0;
}

vsh_result vshi_parts_count(const char *parts, int32_t *count, vsh_error *error) {
    *count = 0;
    const char *slash = strrchr(parts, '/');
    char *folder = slash == NULL ? strdup(".") : strndup(parts, slash == parts ? 1 : (size_t)(slash - parts));
    if (folder == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", parts);
    }
    DIR *open = opendir(folder);
    free(folder);
    if (open == NULL) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: its folder cannot be read: %s", parts, strerror(errno));
    }
    int32_t other = 0;
    for (const struct dirent *entry; (entry = readdir(open)) != NULL;) {
        const int32_t found = count_of_name(entry->d_name, slash != NULL ? slash + 1 : parts);
        other = found != 0 && *count != 0 && found != *count ? found : other;
        *count = found != 0 && *count == 0 ? found : *count;
    }
    closedir(open);
    if (other != 0) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: there are parts of %d and of %d shards beside it; say which, by their number",
                         parts, *count < other ? *count : other, *count < other ? other : *count);
    }
    return *count != 0
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT,
                           "%s: there are no parts beside it, %s.1-of-N.part and so on", parts, parts);
}

vsh_result vshi_parts_check_there(const char *name, int32_t count, vsh_error *error) {
    char list[256] = "";
    size_t at = 0;
    int32_t missing = 0;
    for (int32_t i = 1; i <= count; ++i) {
        char *path = vshi_part_path(name, i, count);
        if (path == NULL) {
            return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", name);
        }
        if (access(path, F_OK) != 0 && ++missing <= MOST_NAMED && at < sizeof list) {
            at += (size_t)snprintf(list + at, sizeof list - at, "%s%d", missing > 1 ? ", " : "", i);
        }
        free(path);
    }
    if (missing == 0) {
        return VSH_OK;
    }
    if (missing > MOST_NAMED && at < sizeof list) {
        snprintf(list + at, sizeof list - at, " and %d more", missing - MOST_NAMED);
    }
    return vshi_fail(error, VSH_ERROR_READ, "%s: %s missing: %s of %d; bake %s by --shard I/%d", name,
                     missing == 1 ? "a part is" : "parts are", list, count, missing == 1 ? "it" : "them",
                     count);
}

vsh_result vshi_parts_first(const char *parts, int32_t shard_count, char **path, vsh_error *error) {
    *path = NULL;
    if (shard_count == 0) {
        VSHI_TRY(vshi_parts_count(parts, &shard_count, error));
    }
    for (int32_t i = 1; i <= shard_count; ++i) {
        *path = vshi_part_path(parts, i, shard_count);
        if (*path == NULL || i == shard_count || access(*path, F_OK) == 0) {
            break;
        }
        free(*path);
    }
    return *path != NULL ? VSH_OK
                         : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", parts);
}
