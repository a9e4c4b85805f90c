#include "base/try.h"
#include "scene/outline_keys.h"
#include "scene/parts.h"
#include "scene/transform.h"
#include "scene/tree.h"

#include <string.h>
#include <strings.h>
#include <unistd.h>
#include <vdbshade/settings.h>

enum {
    MESH = 1 << VSH_CASTER_MESH,
    SDF = 1 << VSH_CASTER_SDF,
    VDB = 1 << VSH_CASTER_VDB,
    HEIGHTFIELD = 1 << VSH_CASTER_HEIGHTFIELD,
    SPHERES = 1 << VSH_CASTER_SPHERES,
    MASK = 1 << VSH_CASTER_MASK,
    TEXT = 1 << VSH_CASTER_TEXT
};

static const char *const types[] = {
    [VSH_CASTER_MESH] = "mesh",       [VSH_CASTER_SDF] = "sdf",
    [VSH_CASTER_VDB] = "vdb",         [VSH_CASTER_HEIGHTFIELD] = "heightfield",
    [VSH_CASTER_SPHERES] = "spheres", [VSH_CASTER_MASK] = "mask",
    [VSH_CASTER_TEXT] = "text"};
enum { TYPE_COUNT = sizeof types / sizeof types[0] };
static const char *const whats[] = {[VSH_CASTER_MESH] = "a mesh caster",
                                    [VSH_CASTER_SDF] = "an sdf caster",
                                    [VSH_CASTER_VDB] = "a vdb caster",
                                    [VSH_CASTER_HEIGHTFIELD] = "a heightfield caster",
                                    [VSH_CASTER_SPHERES] = "a caster of spheres",
                                    [VSH_CASTER_MASK] = "a mask caster",
                                    [VSH_CASTER_TEXT] = "a text caster"};

/* A file's name, or [[x, y, z, radius], …]. */
static vsh_result read_spheres(vshi_json *reader, const vshi_value *value, void *member) {
    static const vshi_key path = {.kind = VSHI_PATH};
    static const vshi_key sphere = {
        .kind = VSHI_VECTOR, .count = 4, .lowest = -VSHI_LARGEST, .highest = VSHI_LARGEST};
    vsh_caster *caster = member;
    if (json_is_string(value->json)) {
        return vshi_read_value(reader, value, &path, &caster->path);
    }
    if (!json_is_array(value->json)) {
        return vshi_json_fail(reader, value, "expected a file's name or an array of [x, y, z, radius]");
    }
    double *spheres;
    caster->sphere_count = json_array_size(value->json);
    if (caster->sphere_count == 0) {
        return vshi_json_fail(reader, value, "is empty");
    }
    VSHI_TRY(
        vshi_json_allocate(reader, (void **)&spheres, caster->sphere_count, sizeof(double[4]), "spheres"));
    for (size_t i = 0; i < caster->sphere_count; ++i) {
        const vshi_value item = vshi_item(value, i);
        VSHI_TRY(vshi_read_value(reader, &item, &sphere, spheres + 4 * i));
        if (!(spheres[4 * i + 3] > 0.0)) {
            const vshi_value radius = vshi_item(&item, 3);
            return vshi_json_fail(reader, &radius, "%.9g is out of range 0 (excluded) … %.9g",
                                  spheres[4 * i + 3], VSHI_LARGEST);
        }
    }
    caster->spheres = spheres;
    return VSH_OK;
}

/* FILE.vdb, or FILE.vdb:NAME: the file's grid NAME. A file whose own name holds a colon is that file. */
static vsh_result read_vdb(vshi_json *reader, const vshi_value *value, void *member) {
    static const vshi_key path = {.kind = VSHI_PATH};
    vsh_caster *caster = member;
    VSHI_TRY(vshi_read_value(reader, value, &path, &caster->path));
    const char *colon = NULL;
    for (const char *at = strchr(caster->path, ':'); at != NULL; at = strchr(at + 1, ':')) {
        colon = at - caster->path > 4 && strncasecmp(at - 4, ".vdb", 4) == 0 ? at : colon;
    }
    if (colon != NULL && access(caster->path, F_OK) != 0) {
        const size_t length = (size_t)(colon - caster->path);
        char *file;
        VSHI_TRY(vshi_json_allocate(reader, (void **)&file, length + 1, 1, "file name"));
        memcpy(file, caster->path, length);
        file[length] = '\0';
        caster->grid = colon + 1;
        caster->path = file;
    }
    return VSH_OK;
}

static const vshi_key caster_keys[] = {
    {.name = "mesh", .kind = VSHI_PATH, .variants = MESH, .offset = offsetof(vsh_caster, path)},
    {.name = "objects",
     .kind = VSHI_CUSTOM,
     .variants = MESH,
     .offset = offsetof(vsh_caster, objects),
     .read = vshi_read_only},
    {.name = "except",
     .kind = VSHI_CUSTOM,
     .variants = MESH,
     .offset = offsetof(vsh_caster, objects),
     .read = vshi_read_except},
    {.name = "solid", .kind = VSHI_CUSTOM, .variants = MESH, .read = vshi_read_solid},
    {.name = "shell", .kind = VSHI_CUSTOM, .variants = MESH, .read = vshi_read_shell},
    {.name = "inward", .kind = VSHI_CUSTOM, .variants = MESH, .read = vshi_read_inward},
    {.name = "one_sided", .kind = VSHI_CUSTOM, .variants = MESH, .read = vshi_read_one_sided},
    {.name = "sdf",
     .kind = VSHI_CUSTOM,
     .variants = SDF,
     .offset = offsetof(vsh_caster, sdf),
     .read = vshi_read_sdf},
    {.name = "vdb", .kind = VSHI_CUSTOM, .variants = VDB, .read = read_vdb},
    {.name = "grid", .kind = VSHI_STRING, .variants = VDB, .offset = offsetof(vsh_caster, grid)},
    {.name = "heightfield", .kind = VSHI_PATH, .variants = HEIGHTFIELD, .offset = offsetof(vsh_caster, path)},
    {.name = "extent",
     .kind = VSHI_VECTOR,
     .variants = HEIGHTFIELD,
     .offset = offsetof(vsh_caster, size),
     .count = 2,
     .lowest = 1e-12,
     .highest = 1e12},
    {.name = "size", /* the old name of "extent" */
     .kind = VSHI_VECTOR,
     .variants = HEIGHTFIELD,
     .offset = offsetof(vsh_caster, size),
     .count = 2,
     .lowest = 1e-12,
     .highest = 1e12},
    {.name = "height",
     .kind = VSHI_NUMBER,
     .variants = HEIGHTFIELD,
     .required = HEIGHTFIELD,
     .offset = offsetof(vsh_caster, height),
     .lowest = -1e12,
     .highest = 1e12},
    {.name = "base",
     .kind = VSHI_NUMBER,
     .variants = HEIGHTFIELD,
     .offset = offsetof(vsh_caster, base),
     .highest = 1e12,
     .flags = VSHI_ABOVE},
    {.name = "direct", .kind = VSHI_BOOL, .variants = HEIGHTFIELD, .offset = offsetof(vsh_caster, direct)},
    {.name = "spheres", .kind = VSHI_CUSTOM, .variants = SPHERES, .read = read_spheres},
    {.name = "voxelised", .kind = VSHI_BOOL, .variants = SPHERES, .offset = offsetof(vsh_caster, voxelised)},
    {.name = "transform",
     .kind = VSHI_CUSTOM,
     .offset = offsetof(vsh_caster, transform),
     .read = vshi_read_transform},
    {.name = "layer", .kind = VSHI_STRING, .offset = offsetof(vsh_caster, layer)},
    {.name = "color",
     .kind = VSHI_VECTOR,
     .offset = offsetof(vsh_caster, color),
     .highest = 1.0,
     .flags = VSHI_NONZERO,
     .count = 3},
    VSHI_OUTLINE_KEYS(vsh_caster, MASK, TEXT),
    {.name = "thickness",
     .kind = VSHI_NUMBER,
     .variants = MASK | TEXT,
     .required = MASK | TEXT,
     .offset = offsetof(vsh_caster, thickness),
     .highest = VSHI_LARGEST,
     .flags = VSHI_ABOVE},
};
static const vshi_table caster_table = VSHI_TABLE(caster_keys);

vsh_result vshi_read_caster(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_caster *caster = member;
    *caster = vsh_caster_default();
    caster->type = -1;
    vsh_result result = vshi_expect(reader, value, JSON_OBJECT);
    if (result != VSH_OK) {
        return result;
    }
    vshi_value given, transform;
    for (int32_t i = VSH_CASTER_MESH; i < TYPE_COUNT; ++i) {
        if (!vshi_member(value, types[i], &given)) {
            continue;
        }
        if (caster->type >= 0) {
            return vshi_reject_both(reader, value, types[caster->type], types[i]);
        }
        caster->type = i;
    }
    /* A caster of no type still has its keys looked over: the type's name may be what is misspelt. */
    const uint32_t variant = caster->type < 0 ? VSHI_ALL : 1U << caster->type;
    result = vshi_read_object(reader, value, &caster_table, variant,
                              caster->type < 0 ? "a caster" : whats[caster->type], caster);
    if (result != VSH_OK) {
        return result;
    }
    if (caster->type < 0) {
        return vshi_json_fail(reader, value,
                              "key \"mesh\", \"sdf\", \"vdb\", \"heightfield\", \"spheres\", \"mask\" "
                              "or \"text\" is missing");
    }
    if (caster->type == VSH_CASTER_HEIGHTFIELD) {
        VSHI_TRY(vshi_reject_both(reader, value, "extent", "size"));
        if (!(caster->size[0] > 0.0)) {
            return vshi_json_fail(reader, value, "key \"extent\" is missing: %s needs it",
                                  whats[caster->type]);
        }
    }
    if (caster->type != VSH_CASTER_MESH && !vshi_transform_is_similarity(caster->transform) &&
        vshi_member(value, "transform", &transform)) {
        return vshi_json_fail(reader, &transform, "shears or scales unevenly, which %s cannot",
                              whats[caster->type]);
    }
    return VSH_OK;
}
