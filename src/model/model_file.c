/* Reading a mesh file: its ending chooses the reader. */
#include "base/file.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/threads.h"
#include "model/gltf.h"
#include "model/obj.h"
#include "model/text.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

enum { HEAD = 512 };

static const char alembic[] = "an Alembic file", usd[] = "a USD file";
static const char blender[] = "Blender's own file; export it as GLB (File, Export, glTF 2.0)";

static const struct {
    const char *ending, *what;
} unread_endings[] = {{"abc", alembic}, {"usd", usd},  {"usda", usd},
                      {"usdc", usd},    {"usdz", usd}, {"blend", blender}};

static const struct {
    const char *bytes;
    size_t size;
    const char *what;
} beginnings[] = {
    {"Ogawa", 5, alembic}, {"\x89HDF\r\n\x1a\n", 8, alembic}, /* before 2013; no other format that meshes come
                                                                 in is HDF5 */
    {"#usda", 5, usd},     {"BLENDER-v", 9, blender},         {"BLENDER_v", 9, blender}, {"PXR-USDC", 8, usd},
};

/* A USDZ file is a Zip file whose first entry is a USD file. */
static bool is_usdz(const unsigned char *head, size_t size) {
    enum { NAME_SIZE = 26, NAME = 30 }; /* of the entry's header */
    if (size < NAME || memcmp(head, "PK\x03\x04", 4) != 0) {
        return false;
    }
    const size_t length = (size_t)head[NAME_SIZE] | (size_t)head[NAME_SIZE + 1] << 8;
    if (length < 5 || NAME + length > size) {
        return false;
    }
    const char *last = (const char *)head + NAME + length;
    return strncasecmp(last - 4, ".usd", 4) == 0 || strncasecmp(last - 5, ".usda", 5) == 0 ||
           strncasecmp(last - 5, ".usdc", 5) == 0;
}

static const char *by_content(const char *path) {
    unsigned char head[HEAD];
    FILE *file;
    uint64_t whole;
    vsh_error ignored; /* reading the file fails with it again */
    vshi_input_open(path, path, UINT64_MAX, &file, &whole, &ignored);
    const size_t size = file != NULL ? fread(head, 1, sizeof head, file) : 0;
    if (file != NULL) {
        fclose(file);
    }
    for (size_t i = 0; i < sizeof beginnings / sizeof beginnings[0]; ++i) {
        if (size >= beginnings[i].size && memcmp(head, beginnings[i].bytes, beginnings[i].size) == 0) {
            return beginnings[i].what;
        }
    }
    return is_usdz(head, size) ? usd : NULL;
}

vsh_result vshi_unsupported_check(const char *path, vsh_error *error) {
    const char *what = by_content(path);
    const char *ending = vshi_path_ending(path);
    for (size_t i = 0; what == NULL && i < sizeof unread_endings / sizeof unread_endings[0]; ++i) {
        what = strcasecmp(ending, unread_endings[i].ending) == 0 ? unread_endings[i].what : NULL;
    }
    return what == NULL
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT, "%s: is %s, which is not read: " VSHI_FORMATS, path, what);
}

/* Bytes that reading takes at its peak for one byte of a file that is read whole: its text, Assimp's
 * structures and our arrays. Measured on a million triangles: GLB 4.2, STL 3.4. Some files unfold further
 * (compressed FBX, many faces of few vertices): what Assimp found is measured once more before it is copied.
 */
static const double PEAK_BYTES_A_BYTE = 6.0;

enum { SCAN_UNITS = 150, IMPORT_UNITS = 600, READ_UNITS = SCAN_UNITS + IMPORT_UNITS, REST_UNITS = 250 };

/* Formats that are read, each tested with what Blender writes (tests/models). Assimp reads more, and some of
 * them wrongly. */
static const char *const endings[] = {"obj", "gltf", "glb", "ply", "stl", "fbx", "dae"};

static vsh_result check_ending(const char *path, const char **ending, vsh_error *error) {
    *ending = vshi_path_ending(path);
    if (**ending == '\0') {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: has no ending to tell its format by (.obj, .glb, .ply …)", path);
    }
    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; ++i) {
        if (strcasecmp(*ending, endings[i]) == 0) {
            return VSH_OK;
        }
    }
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: '.%s' is no mesh format that is read: " VSHI_FORMATS, path,
                     *ending);
}

bool vshi_is_gltf(const char *path) {
    const char *ending = vshi_path_ending(path);
    return strcasecmp(ending, "gltf") == 0 || strcasecmp(ending, "glb") == 0;
}

typedef struct reading {
    const char *path;
    const vsh_run *run;
    vshi_job *job;
    vsh_model **model;
} reading;

/* Loads a file whole. Reads it if it is a glTF, else looks over it for Assimp. */
static vsh_result read_text(const reading *r, vshi_assimp *assimp, vsh_error *error) {
    vshi_budget budget = {r->path, r->run, 0.0};
    vshi_text text;
    vsh_result result;
    VSHI_TRY_DONE(vshi_text_read(&text, r->path, r->path, &budget, r->job, SCAN_UNITS, error));
    VSHI_TRY_DONE(vshi_check_limit(r->run, PEAK_BYTES_A_BYTE * (double)text.size, r->path, error));
    VSHI_TRY_DONE(vshi_is_gltf(r->path)
                      ? vshi_gltf_read(r->path, text.bytes, text.size, r->run, r->job, r->model, error)
                      : vshi_assimp_look(assimp, &text, error));
    VSHI_TRY_DONE(vshi_text_poll(&text, text.bytes + text.size, error));
done:
    vshi_text_free(&text);
    return result;
}

static vsh_result read_file(void *user, vsh_error *error) {
    const reading *r = user;
    const char *ending = NULL;
    vshi_assimp assimp = {.path = r->path, .run = r->run, .job = r->job};
    struct stat status;
    /* A missing file is that first, whatever its ending. */
    if (stat(r->path, &status) != 0) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: %s", r->path, strerror(errno));
    }
    VSHI_TRY(vshi_unsupported_check(r->path, error));
    VSHI_TRY(check_ending(r->path, &ending, error));
    if (strcasecmp(ending, "obj") == 0) {
        return vshi_obj_read(r->path, r->run, r->job, READ_UNITS, r->model, error);
    }
    if (strcasecmp(ending, "ply") == 0) {
        return vshi_ply_read(r->path, r->run, r->job, READ_UNITS, r->model, error);
    }
    VSHI_TRY(read_text(r, &assimp, error));
    return *r->model != NULL ? VSH_OK : vshi_assimp_read(&assimp, IMPORT_UNITS, r->model, error);
}

vsh_result vsh_model_read(const char *path, const vsh_run *run, vsh_model **model, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(model);
    *model = NULL;
    VSHI_NEEDS(path);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vshi_job *job = vshi_job_begin(&full, "load", READ_UNITS + REST_UNITS);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    reading r = {path, &full, job, model};
    vsh_result result;
    VSHI_TRY_DONE(full.reader != NULL ? vshi_model_from_reader(path, &full, job, READ_UNITS, model, error)
                                      : vshi_on_stack(read_file, &r, error));
    if (vshi_job_advance(job, REST_UNITS)) {
        result = vshi_job_fail_cancelled(job, error);
    }
done:
    vshi_job_end(job);
    if (result != VSH_OK) {
        vsh_model_free(*model);
        *model = NULL;
    }
    return result;
}
