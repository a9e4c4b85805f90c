#include "lit/work.h"

#include "base/file.h"
#include "base/numbers.h"
#include "base/vec.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

static const char FIRST_LINE[] = "# vdbshade ";

bool vshi_lit_is_obj(const char *path) {
    return strcasecmp(vshi_path_ending(path), "obj") == 0;
}

vsh_result vshi_lit_obj_check(const vshi_lit_work *work, vsh_error *error) {
    const vsh_lit_options *options = work->options;
    if (options->image_place == VSH_LIT_IMAGES_EMBED) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: an OBJ holds no images; they stand beside it",
                         work->output);
    }
    for (size_t i = 0; i < options->image_count; ++i) {
        if (options->images[i].purpose != VSH_LIT_PREVIEW) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "%s: image %zu: materials of an OBJ show a preview, and no other image",
                             work->output, i);
        }
    }
    return VSH_OK;
}

/* --- text */

typedef struct text {
    vshi_lit_put *put;
    void *file;
    size_t used;
    char buffer[1 << 14];
} text;

enum { LONGEST = 512 /* bytes that one call of say() comes to at most */ };

static void flush(text *t) {
    t->put(t->file, t->buffer, t->used);
    t->used = 0;
}

__attribute__((format(printf, 2, 3))) static void say(text *t, const char *format, ...) {
    if (sizeof t->buffer - t->used < LONGEST) {
        flush(t);
    }
    va_list values;
    va_start(values, format);
    t->used += (size_t)vsnprintf(t->buffer + t->used, LONGEST, format, values);
    va_end(values);
}

/* A line of words that may be long, as they are; NULL behind the last. */
static void say_words(text *t, const char *const *words) {
    for (; *words != NULL; ++words) {
        for (const char *c = *words; *c != '\0'; ++c) {
            say(t, "%c", *c);
        }
    }
    say(t, "\n");
}

/* A name as OBJ has them: no blanks, no control characters. */
static void say_name(text *t, const char *keyword, const char *name) {
    say(t, "%s ", keyword);
    for (; *name != '\0'; ++name) {
        say(t, "%c", (unsigned char)*name <= ' ' || *name == 0x7f ? '_' : *name);
    }
    say(t, "\n");
}

/* The material of a page: it has the page's name, or its number. */
static void say_page(text *t, const vshi_lit_work *work, const char *keyword, size_t page) {
    const vsh_lit_options *options = work->options;
    const char *name = page < options->page_count ? options->page_names[page] : NULL;
    if (name != NULL) {
        say_name(t, keyword, name);
    } else {
        say(t, "%s page_%zu\n", keyword, page);
    }
}

static void begin(text *t, vshi_lit_put *put, void *file) {
    t->put = put;
    t->file = file;
    t->used = 0;
    say(t, "%s%s\n", FIRST_LINE, VSHI_VERSION);
}

/* --- meshes */

/* Numbers before the first of a mesh: OBJ counts over the whole file. */
typedef struct counts {
    uint64_t positions, uvs, normals;
} counts;

/* A mesh with the UVs that it is lit by; uvs NULL: it is not. */
typedef struct placed {
    vsh_mesh mesh;
    const vsh_lit_mesh *lit;
    const float *uvs;
    const uint32_t *indices, *sources; /* sources NULL: vertices are the mesh's own */
    size_t vertex_count;               /* of UVs */
} placed;

static placed place(const vshi_lit_work *work, size_t index) {
    placed p = {.lit = &work->meshes[index], .sources = NULL};
    p.mesh = vsh_model_mesh(work->model, index, p.lit->uvs == NULL ? p.lit->uv_set : 0);
    p.uvs = p.lit->uvs != NULL ? p.lit->uvs : p.lit->uv_set >= 0 ? p.mesh.uvs : NULL;
    p.indices = p.lit->uvs != NULL ? p.lit->indices : p.mesh.indices;
    p.sources = p.lit->uvs != NULL ? p.lit->sources : NULL;
    p.vertex_count = p.lit->uvs != NULL ? p.lit->vertex_count : p.uvs != NULL ? p.mesh.vertex_count : 0;
    return p;
}

static void put_names(text *t, const vsh_mesh *mesh, const vsh_mesh *before, size_t index) {
    const char *name = mesh->name != NULL && mesh->name[0] != '\0' ? mesh->name : NULL;
    const char *object = mesh->object_name != NULL && mesh->object_name[0] != '\0' ? mesh->object_name : name;
    const bool again = before != NULL && mesh->object != 0 && before->object == mesh->object;
    if (object == NULL) {
        say(t, "o mesh_%zu\n", index);
        return;
    }
    if (!again) {
        say_name(t, "o", object);
    }
    if (name != NULL && strcmp(name, object) != 0) {
        say_name(t, "g", name);
    }
}

static void put_vertices(text *t, const placed *p) {
    const vsh_mesh *mesh = &p->mesh;
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        const vshi_vec at = vshi_transform_point(mesh->transform, vshi_vec_off(mesh->positions + 3 * v));
        say(t, "v %.9g %.9g %.9g\n", at.x, at.y, at.z);
    }
    for (size_t v = 0; v < p->vertex_count; ++v) {
        say(t, "vt %.9g %.9g\n", (double)p->uvs[2 * v], (double)p->uvs[2 * v + 1]);
    }
    for (size_t v = 0; mesh->normals != NULL && v < mesh->vertex_count; ++v) {
        const vshi_vec n =
            vshi_unit(vshi_transform_normal(mesh->transform, vshi_vec_off(mesh->normals + 3 * v)));
        say(t, "vn %.6g %.6g %.6g\n", n.x, n.y, n.z);
    }
}

static void put_face(text *t, const placed *p, size_t triangle, const counts *before) {
    const bool mirrored =
        vshi_transform_determinant(p->mesh.transform) < 0.0; /* faces look outwards in the world */
    say(t, "f");
    for (size_t i = 0; i < 3; ++i) {
        const uint32_t v = p->indices[3 * triangle + (mirrored ? 2 - i : i)];
        const uint64_t source = p->sources != NULL ? p->sources[v] : v;
        say(t, " %" PRIu64, before->positions + source + 1);
        if (p->uvs != NULL) {
            say(t, "/%" PRIu64, before->uvs + v + 1);
        }
        if (p->mesh.normals != NULL) {
            say(t, p->uvs != NULL ? "/%" PRIu64 : "//%" PRIu64, before->normals + source + 1);
        }
    }
    say(t, "\n");
}

/* A material where it changes; what has no place shows the first page. */
static void put_faces(text *t, const vshi_lit_work *work, const placed *p, bool paged, const counts *before) {
    const bool shown = p->uvs != NULL;
    uint32_t page = UINT32_MAX;
    if (paged && !shown) {
        say(t, "usemtl unlit\n");
    }
    for (size_t i = 0; i < p->mesh.triangle_count; ++i) {
        const uint32_t found = shown ? vshi_lit_page(work, p->lit, i) : 0;
        const uint32_t own = found != VSH_LIT_NO_CHART ? found : 0;
        if (paged && shown && own != page) {
            say_page(t, work, "usemtl", own);
            page = own;
        }
        put_face(t, p, i, before);
    }
}

vsh_result vshi_lit_put_obj(const vshi_lit_work *work, const char *mtl, vshi_lit_put *put, void *file,
                            vsh_error *error) {
    VSHI_NUMBERS;
    text t;
    counts before = {0, 0, 0};
    placed last = {.lit = NULL};
    begin(&t, put, file);
    for (size_t i = 0; i < work->options->attribute_count; ++i) {
        const vsh_attribute *one = &work->options->attributes[i];
        say_words(&t, (const char *[]){"# ", one->name, ": ", one->value, NULL});
    }
    if (mtl != NULL) {
        say_words(&t, (const char *[]){"mtllib ", mtl, NULL});
    }
    for (size_t i = 0; i < vsh_model_mesh_count(work->model); ++i) {
        if (vshi_job_advance(work->document.gltf.job, 1)) {
            return vshi_job_fail_cancelled(work->document.gltf.job, error);
        }
        const placed p = place(work, i);
        put_names(&t, &p.mesh, i > 0 ? &last.mesh : NULL, i);
        put_vertices(&t, &p);
        put_faces(&t, work, &p, mtl != NULL || work->page_count > 1, &before);
        before.positions += p.mesh.vertex_count;
        before.uvs += p.vertex_count;
        before.normals += p.mesh.normals != NULL ? p.mesh.vertex_count : 0;
        last = p;
    }
    flush(&t);
    return VSH_OK;
}

/* --- materials */

static void put_material(text *t, const char *image) {
    say(t, "Ka 1 1 1\nKd 1 1 1\nKs 0 0 0\nillum 1\n");
    static const char *const maps[] = {"map_Ka", "map_Kd"};
    for (size_t k = 0; k < sizeof maps / sizeof maps[0] && image != NULL; ++k) {
        say_words(t, (const char *[]){maps[k], " ", image, NULL});
    }
}

void vshi_lit_put_mtl(const vshi_lit_work *work, const vshi_lit_besides *besides, vshi_lit_put *put,
                      void *file) {
    text t;
    begin(&t, put, file);
    for (size_t page = 0; page < work->page_count; ++page) {
        const char *image = NULL;
        for (size_t i = 0; i < besides->count; ++i) { /* in the order of the images that were given */
            image = work->options->images[i].page == page ? besides->list[i].name : image;
        }
        say_page(&t, work, "newmtl", page);
        put_material(&t, image);
    }
    bool unlit = false;
    for (size_t i = 0; i < vsh_model_mesh_count(work->model) && !unlit; ++i) {
        unlit = work->meshes[i].uvs == NULL && work->meshes[i].uv_set < 0;
    }
    if (unlit) {
        say(&t, "newmtl unlit\n");
        put_material(&t, NULL);
    }
    flush(&t);
}

vsh_result vshi_lit_mtl_check(const char *path, vsh_error *error) {
    char begins[sizeof FIRST_LINE] = "";
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return VSH_OK;
    }
    const size_t count = fread(begins, 1, sizeof begins - 1, file);
    fclose(file);
    return count == 0 || strcmp(begins, FIRST_LINE) == 0
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_ARGUMENT,
                           "%s: would be replaced, which vdbshade has not written: give the OBJ another name",
                           path);
}
