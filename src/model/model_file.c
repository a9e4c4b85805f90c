#include "model/model_file.h"

#include "base/file.h"
#include "base/input.h"
#include "base/memory.h"
#include "base/try.h"
#include "model/gltf.h"
#include "model/obj.h"
#include "model/scan.h"

#include <assimp/scene.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/mman.h>
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

enum {
    SCAN_UNITS = 150,
    IMPORT_UNITS = 600,
    READ_UNITS = SCAN_UNITS + IMPORT_UNITS,
    CHECK_UNITS = VSHI_MODEL_FILE_UNITS - READ_UNITS
};

/* Formats that are read, each tested with what Blender writes (tests/models). Assimp reads more, and some of
 * them wrongly. */
static const char *const endings[] = {"obj", "gltf", "glb", "ply", "stl", "fbx", "dae"};

static vsh_result check_ending(const char *path, const char **ending, vsh_error *error) {
    const char *slash = strrchr(path, '/');
    const char *dot = strrchr(slash != NULL ? slash : path, '.');
    if (dot == NULL || dot[1] == '\0') {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: has no ending to tell its format by (.obj, .glb, .ply …)", path);
    }
    *ending = dot + 1;
    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; ++i) {
        if (strcasecmp(*ending, endings[i]) == 0) {
            return VSH_OK;
        }
    }
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: '.%s' is no mesh format that is read: " VSHI_FORMATS, path,
                     *ending);
}

static bool is_gltf(const char *ending) {
    return strcasecmp(ending, "gltf") == 0 || strcasecmp(ending, "glb") == 0;
}

/* A file in memory. */
typedef struct file_text {
    char *text;
    size_t size;
    bool mapped; /* it is the file's own pages, else a copy */
    uint64_t identity[VSHI_FILE_IDENTITY];
} file_text;

static void free_text(file_text *text) {
    if (text->mapped) {
        munmap(text->text, text->size);
    } else {
        free(text->text);
    }
    *text = (file_text){.text = NULL};
}

/* A file that becomes shorter while its pages are looked at ends the process, which may be the reader's. */
static bool map_text(FILE *file, file_text *text) {
    if (!vshi_file_identity(fileno(file), text->identity)) {
        return false;
    }
    void *map = mmap(NULL, text->size, PROT_READ, MAP_PRIVATE, fileno(file), 0);
    text->mapped = map != MAP_FAILED;
    text->text = text->mapped ? map : NULL;
    return text->mapped;
}

static vsh_result copy_text(const char *path, FILE *file, file_text *text, vsh_error *error) {
    text->text = malloc(text->size);
    if (text->text == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused %zu bytes", path, text->size);
    }
    return fread(text->text, 1, text->size, file) == text->size
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_READ, "%s: %s", path,
                           ferror(file) ? strerror(errno) : "became shorter while it was read");
}

/* The whole file, for free_text(), after an error too. */
static vsh_result load_file(const char *path, const vsh_run *run, bool alone, file_text *text,
                            vsh_error *error) {
    FILE *file;
    uint64_t bytes;
    vsh_result result;
    VSHI_TRY(vshi_input_open(path, path, SIZE_MAX / 2, &file, &bytes, error));
    text->size = (size_t)bytes;
    VSHI_TRY_DONE(bytes > 0 ? vshi_check_limit(run, PEAK_BYTES_A_BYTE * (double)bytes, path, error)
                            : vshi_fail(error, VSH_ERROR_READ, "%s: is empty", path));
    VSHI_TRY_DONE(alone && map_text(file, text) ? VSH_OK : copy_text(path, file, text, error));
done:
    fclose(file);
    return result;
}

static vsh_result scan_file(vshi_scan *scan, const char *ending, const vsh_run *run, bool alone,
                            vsh_model **model, vsh_error *error) {
    file_text text = {.text = NULL};
    vsh_result result;
    VSHI_TRY_DONE(load_file(scan->path, run, alone, &text, error));
    scan->text = text.text;
    scan->size = text.size;
    VSHI_TRY_DONE(is_gltf(ending) ? vshi_gltf_read(scan->path, scan->text, scan->size, text.mapped, run,
                                                   scan->job, model, error)
                                  : vshi_scan_file(scan, ending, error));
    if (*model != NULL && text.mapped) { /* whose arrays may lie there */
        (*model)->file = (vshi_model_file){.map = text.text, .size = text.size};
        memcpy((*model)->file.identity, text.identity, sizeof text.identity);
        text = (file_text){.text = NULL};
    }
    if (vshi_job_advance(scan->job, SCAN_UNITS - scan->units_done)) {
        result = vshi_job_fail_cancelled(scan->job, error);
    }
done:
    free_text(&text);
    scan->text = NULL;
    return result;
}

static vsh_result check_mesh(const char *path, const struct aiMesh *mesh, unsigned place, vsh_error *error) {
    for (unsigned v = 0; v < mesh->mNumVertices; ++v) {
        const struct aiVector3D p = mesh->mVertices[v];
        if (!isfinite(p.x) || !isfinite(p.y) || !isfinite(p.z)) {
            return vshi_fail(
                error, VSH_ERROR_INPUT,
                "%s: mesh %u '%s': vertex %u of %u lies at (%g, %g, %g), expected finite numbers", path,
                place, mesh->mName.data, v, mesh->mNumVertices, (double)p.x, (double)p.y, (double)p.z);
        }
    }
    for (unsigned f = 0; f < mesh->mNumFaces; ++f) {
        const struct aiFace *face = &mesh->mFaces[f];
        for (unsigned k = 0; k < face->mNumIndices; ++k) {
            if (face->mIndices[k] >= mesh->mNumVertices) {
                return vshi_fail(error, VSH_ERROR_INPUT,
                                 "%s: mesh %u '%s': face %u uses vertex %u, but there are only %u", path,
                                 place, mesh->mName.data, f, face->mIndices[k], mesh->mNumVertices);
            }
        }
    }
    return VSH_OK;
}

/* How many faces have three corners or more, and how many triangles those make. */
static void count_faces(const struct aiScene *scene, size_t *faces, size_t *triangles) {
    *faces = *triangles = 0;
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        const struct aiMesh *mesh = scene->mMeshes[m];
        for (unsigned f = 0; f < mesh->mNumFaces; ++f) {
            const unsigned corners = mesh->mFaces[f].mNumIndices;
            *faces += corners >= 3;
            *triangles += corners >= 3 ? corners - 2 : 0;
        }
    }
}

/* Everything that what follows takes for granted, and that nothing was lost on the way here. */
static vsh_result check_scene(const char *path, const struct aiScene *scene, size_t expected, vshi_job *job,
                              vsh_error *error) {
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        if (vshi_job_cancelled(job)) {
            return vshi_job_fail_cancelled(job, error);
        }
        VSHI_TRY(check_mesh(path, scene->mMeshes[m], m, error));
    }
    size_t faces, triangles;
    count_faces(scene, &faces, &triangles);
    if (faces < expected) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: only %zu of its %zu faces can be read: the others use vertices out of range",
                         path, faces, expected);
    }
    if (triangles == 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: holds no triangles", path);
    }
    return VSH_OK;
}

vsh_result vshi_model_file_read(const char *path, const vsh_run *run, vshi_job *job, bool alone,
                                vshi_import **import, vsh_model **model, double *unit, vsh_error *error) {
    *import = NULL;
    *model = NULL;
    const char *ending = NULL;
    vshi_scan scan = {.path = path, .job = job, .units = SCAN_UNITS};
    struct stat status;
    /* A missing file is that first, whatever its ending. */
    if (stat(path, &status) != 0) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: %s", path, strerror(errno));
    }
    VSHI_TRY(vshi_unsupported_check(path, error));
    VSHI_TRY(check_ending(path, &ending, error));
    vsh_result result;
    VSHI_TRY_DONE(strcasecmp(ending, "obj") == 0   ? vshi_obj_read(path, run, job, READ_UNITS, model, error)
                  : strcasecmp(ending, "ply") == 0 ? vshi_ply_read(path, run, job, READ_UNITS, model, error)
                                                   : scan_file(&scan, ending, run, alone, model, error));
    *unit = scan.unit;
    if (*model == NULL) {
        VSHI_TRY_DONE(vshi_importers_load(error));
        VSHI_TRY_DONE(
            vshi_importers()->read(path, run->allow_outside != 0, job, IMPORT_UNITS, import, error));
        VSHI_TRY_DONE(check_scene(path, (*import)->scene, scan.faces, job, error));
    }
    if (vshi_job_advance(job, CHECK_UNITS + (*import == NULL ? IMPORT_UNITS : 0))) {
        result = vshi_job_fail_cancelled(job, error);
    }
done:
    if (result != VSH_OK) {
        if (*import != NULL) {
            vshi_importers()->free(*import);
            *import = NULL;
        }
        vsh_model_free(*model);
        *model = NULL;
    }
    return result;
}
