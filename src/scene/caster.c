#include "scene/parts.h"
#include "scene/transform.h"
#include "scene/tree.h"

#include <vdbshade/scene.h>

enum { MESH = 1 << VSH_CASTER_MESH, SDF = 1 << VSH_CASTER_SDF, VDB = 1 << VSH_CASTER_VDB };

static const char *const types[] = {
    [VSH_CASTER_MESH] = "mesh", [VSH_CASTER_SDF] = "sdf", [VSH_CASTER_VDB] = "vdb"};
static const char *const whats[] = {[VSH_CASTER_MESH] = "a mesh caster",
                                    [VSH_CASTER_SDF] = "an sdf caster",
                                    [VSH_CASTER_VDB] = "a vdb caster"};

static const vshi_key caster_keys[] = {
    {.name = "mesh", .kind = VSHI_PATH, .variants = MESH, .offset = offsetof(vsh_caster, path)},
    {.name = "sdf",
     .kind = VSHI_CUSTOM,
     .variants = SDF,
     .offset = offsetof(vsh_caster, sdf),
     .read = vshi_read_sdf},
    {.name = "vdb", .kind = VSHI_PATH, .variants = VDB, .offset = offsetof(vsh_caster, path)},
    {.name = "grid", .kind = VSHI_STRING, .variants = VDB, .offset = offsetof(vsh_caster, grid)},
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
};
static const vshi_table caster_table = VSHI_TABLE(caster_keys);

vsh_result vshi_read_caster(vshi_reader *reader, const vshi_value *value, void *member) {
    vsh_caster *caster = member;
    caster->type = -1;
    vshi_transform_identity(caster->transform);
    vsh_result result = vshi_expect(reader, value, JSON_OBJECT);
    if (result != VSH_OK) {
        return result;
    }
    vshi_value given, transform;
    for (int32_t i = VSH_CASTER_MESH; i <= VSH_CASTER_VDB; ++i) {
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
        return vshi_reader_fail(reader, value, "key \"mesh\", \"sdf\" or \"vdb\" is missing");
    }
    if (caster->type != VSH_CASTER_MESH && !vshi_transform_is_similarity(caster->transform) &&
        vshi_member(value, "transform", &transform)) {
        return vshi_reader_fail(reader, &transform, "shears or scales unevenly, which %s cannot",
                                whats[caster->type]);
    }
    return VSH_OK;
}
