#include "lit/work.h"

#include "base/decimal.h"
#include "base/file.h"
#include "base/vec.h"

#include <inttypes.h>
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

/* A name as OBJ has them: no blanks, no control characters. */
static void put_name(FILE *to, const char *keyword, const char *name) {
    fprintf(to, "%s ", keyword);
    for (; *name != '\0'; ++name) {
        fputc((unsigned char)*name <= ' ' || *name == 0x7f ? '_' : *name, to);
    }
    fputc('\n', to);
}

/* The material of a page: it has the page's name, or its number. */
static void put_page(FILE *to, const vshi_lit_work *work, const char *keyword, size_t page) {
    const vsh_lit_options *options = work->options;
    const char *name = page < options->page_count ? options->page_names[page] : NULL;
    if (name != NULL) {
        put_name(to, keyword, name);
    } else {
        fprintf(to, "%s page_%zu\n", keyword, page);
    }
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

static void put_names(FILE *to, const vsh_mesh *mesh, const vsh_mesh *before, size_t index) {
    const char *name = mesh->name != NULL && mesh->name[0] != '\0' ? mesh->name : NULL;
    const char *object = mesh->object_name != NULL && mesh->object_name[0] != '\0' ? mesh->object_name : name;
    const bool again = before != NULL && mesh->object != 0 && before->object == mesh->object;
    if (object == NULL) {
        fprintf(to, "o mesh_%zu\n", index);
        return;
    }
    if (!again) {
        put_name(to, "o", object);
    }
    if (name != NULL && strcmp(name, object) != 0) {
        put_name(to, "g", name);
    }
}

static void put_vertices(FILE *to, const placed *p) {
    const vsh_mesh *mesh = &p->mesh;
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        const vshi_vec at = vshi_transform_point(mesh->transform, vshi_vec_off(mesh->positions + 3 * v));
        fprintf(to, "v %.9g %.9g %.9g\n", at.x, at.y, at.z);
    }
    for (size_t v = 0; v < p->vertex_count; ++v) {
        fprintf(to, "vt %.9g %.9g\n", (double)p->uvs[2 * v], (double)p->uvs[2 * v + 1]);
    }
    for (size_t v = 0; mesh->normals != NULL && v < mesh->vertex_count; ++v) {
        const vshi_vec n =
            vshi_unit(vshi_transform_normal(mesh->transform, vshi_vec_off(mesh->normals + 3 * v)));
        fprintf(to, "vn %.6g %.6g %.6g\n", n.x, n.y, n.z);
    }
}

static void put_face(FILE *to, const placed *p, size_t triangle, const counts *before) {
    const bool mirrored =
        vshi_transform_determinant(p->mesh.transform) < 0.0; /* faces look outwards in the world */
    fprintf(to, "f");
    for (size_t i = 0; i < 3; ++i) {
        const uint32_t v = p->indices[3 * triangle + (mirrored ? 2 - i : i)];
        const uint64_t source = p->sources != NULL ? p->sources[v] : v;
        fprintf(to, " %" PRIu64, before->positions + source + 1);
        if (p->uvs != NULL) {
            fprintf(to, "/%" PRIu64, before->uvs + v + 1);
        }
        if (p->mesh.normals != NULL) {
            fprintf(to, p->uvs != NULL ? "/%" PRIu64 : "//%" PRIu64, before->normals + source + 1);
        }
    }
    fprintf(to, "\n");
}

/* A material where it changes; what has no place shows the first page. */
static void put_faces(FILE *to, const vshi_lit_work *work, const placed *p, bool paged,
                      const counts *before) {
    const bool shown = p->uvs != NULL;
    uint32_t page = UINT32_MAX;
    if (paged && !shown) {
        fprintf(to, "usemtl unlit\n");
    }
    for (size_t i = 0; i < p->mesh.triangle_count; ++i) {
        const uint32_t found = shown ? vshi_lit_page(work, p->lit, i) : 0;
        const uint32_t own = found != VSH_LIT_NO_CHART ? found : 0;
        if (paged && shown && own != page) {
            put_page(to, work, "usemtl", own);
            page = own;
        }
        put_face(to, p, i, before);
    }
}

vsh_result vshi_lit_put_obj(const vshi_lit_work *work, const char *mtl, FILE *to, vsh_error *error) {
    VSHI_NUMBERS;
    counts before = {0, 0, 0};
    placed last = {.lit = NULL};
    fprintf(to, "%s%s\n", FIRST_LINE, VSHI_VERSION);
    for (size_t i = 0; i < work->options->attribute_count; ++i) {
        const vsh_attribute *one = &work->options->attributes[i];
        fprintf(to, "# %s: %s\n", one->name, one->value);
    }
    if (mtl != NULL) {
        fprintf(to, "mtllib %s\n", mtl);
    }
    for (size_t i = 0; i < vsh_model_mesh_count(work->model); ++i) {
        if (vshi_job_advance(work->document.gltf.job, 1)) {
            return vshi_job_fail_cancelled(work->document.gltf.job, error);
        }
        const placed p = place(work, i);
        put_names(to, &p.mesh, i > 0 ? &last.mesh : NULL, i);
        put_vertices(to, &p);
        put_faces(to, work, &p, mtl != NULL || work->page_count > 1, &before);
        before.positions += p.mesh.vertex_count;
        before.uvs += p.vertex_count;
        before.normals += p.mesh.normals != NULL ? p.mesh.vertex_count : 0;
        last = p;
    }
    return VSH_OK;
}

/* --- materials */

static void put_material(FILE *to, const char *image) {
    fprintf(to, "Ka 1 1 1\nKd 1 1 1\nKs 0 0 0\nillum 1\n");
    static const char *const maps[] = {"map_Ka", "map_Kd"};
    for (size_t k = 0; k < sizeof maps / sizeof maps[0] && image != NULL; ++k) {
        fprintf(to, "%s %s\n", maps[k], image);
    }
}

void vshi_lit_put_mtl(const vshi_lit_work *work, const vshi_lit_besides *besides, FILE *to) {
    fprintf(to, "%s%s\n", FIRST_LINE, VSHI_VERSION);
    for (size_t page = 0; page < work->page_count; ++page) {
        const char *image = NULL;
        for (size_t i = 0; i < besides->count; ++i) { /* in the order of the images that were given */
            image = work->options->images[i].page == page ? besides->list[i].name : image;
        }
        put_page(to, work, "newmtl", page);
        put_material(to, image);
    }
    bool unlit = false;
    for (size_t i = 0; i < vsh_model_mesh_count(work->model) && !unlit; ++i) {
        unlit = work->meshes[i].uvs == NULL && work->meshes[i].uv_set < 0;
    }
    if (unlit) {
        fprintf(to, "newmtl unlit\n");
        put_material(to, NULL);
    }
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
