#include "scene/tree.h"

#include "base/memory.h"
#include "base/try.h"
#include "scene/transform.h"

#include <vdbshade/sdf.h>

#include <stdlib.h>
#include <string.h>

enum { MAX_NODES = 65536, MAX_LEVELS = 64 };

#define BIT(shape) (1U << (shape))
#define OPERATIONS                                                                                           \
    (BIT(VSH_SDF_UNION) | BIT(VSH_SDF_INTERSECTION) | BIT(VSH_SDF_SUBTRACTION) | BIT(VSH_SDF_SMOOTH_UNION))
#define ROUND                                                                                                \
    (BIT(VSH_SDF_SPHERE) | BIT(VSH_SDF_TORUS) | BIT(VSH_SDF_CAPSULE) | BIT(VSH_SDF_CYLINDER) |               \
     BIT(VSH_SDF_CONE))
#define TALL (BIT(VSH_SDF_CAPSULE) | BIT(VSH_SDF_CYLINDER) | BIT(VSH_SDF_CONE))

/* By VSH_SDF_…: shapes, and from VSH_SDF_UNION on, operations. */
static const struct {
    const char *name;
    const char *what;
} shapes[] = {
    [VSH_SDF_SPHERE] = {"sphere", "a sphere"},
    [VSH_SDF_BOX] = {"box", "a box"},
    [VSH_SDF_TORUS] = {"torus", "a torus"},
    [VSH_SDF_PLANE] = {"plane", "a plane"},
    [VSH_SDF_CAPSULE] = {"capsule", "a capsule"},
    [VSH_SDF_CYLINDER] = {"cylinder", "a cylinder"},
    [VSH_SDF_CONE] = {"cone", "a cone"},
    [VSH_SDF_UNION] = {"union", "a union"},
    [VSH_SDF_INTERSECTION] = {"intersection", "an intersection"},
    [VSH_SDF_SUBTRACTION] = {"subtraction", "a subtraction"},
    [VSH_SDF_SMOOTH_UNION] = {"smooth_union", "a smooth union"},
};

static const char *shape_name(int32_t i) {
    return i < VSH_SDF_UNION ? shapes[i].name : NULL;
}

static const char *operation_name(int32_t i) {
    return i <= VSH_SDF_SMOOTH_UNION - VSH_SDF_UNION ? shapes[VSH_SDF_UNION + i].name : NULL;
}

/* [x, z] into size[0] and size[2]. */
static vsh_result read_plane_size(vshi_json *reader, const vshi_value *value, void *member) {
    const vshi_key key = {.kind = VSHI_VECTOR, .count = 2, .highest = VSHI_LARGEST, .flags = VSHI_ABOVE};
    double size[2];
    VSHI_TRY(vshi_read_value(reader, value, &key, size));
    ((double *)member)[0] = size[0];
    ((double *)member)[2] = size[1];
    return VSH_OK;
}

#define LENGTH(key, bits, member)                                                                            \
    {                                                                                                        \
        .name = key, .kind = VSHI_NUMBER, .variants = bits, .required = bits,                                \
        .offset = offsetof(vsh_sdf_node, member), .highest = VSHI_LARGEST, .flags = VSHI_ABOVE               \
    }

static const vshi_key node_keys[] = {
    {.name = "shape", .kind = VSHI_LATER, .variants = ~OPERATIONS},
    {.name = "op", .kind = VSHI_LATER, .variants = OPERATIONS},
    {.name = "of", .kind = VSHI_LATER, .variants = OPERATIONS, .required = OPERATIONS},
    LENGTH("radius", ROUND, radius),
    LENGTH("tube_radius", BIT(VSH_SDF_TORUS), minor_radius),
    LENGTH("half_height", TALL, size[1]),
    LENGTH("thickness", BIT(VSH_SDF_PLANE), size[1]),
    LENGTH("smoothing", BIT(VSH_SDF_SMOOTH_UNION), smoothing),
    {.name = "half_size",
     .kind = VSHI_VECTOR,
     .variants = BIT(VSH_SDF_BOX),
     .required = BIT(VSH_SDF_BOX),
     .offset = offsetof(vsh_sdf_node, size),
     .count = 3,
     .highest = VSHI_LARGEST,
     .flags = VSHI_ABOVE},
    {.name = "half_size",
     .kind = VSHI_CUSTOM,
     .variants = BIT(VSH_SDF_PLANE),
     .required = BIT(VSH_SDF_PLANE),
     .offset = offsetof(vsh_sdf_node, size),
     .read = read_plane_size},
    {.name = "rounding",
     .kind = VSHI_NUMBER,
     .variants = BIT(VSH_SDF_BOX),
     .offset = offsetof(vsh_sdf_node, rounding),
     .highest = VSHI_LARGEST},
    {.name = "top_radius",
     .kind = VSHI_NUMBER,
     .variants = BIT(VSH_SDF_CONE),
     .offset = offsetof(vsh_sdf_node, minor_radius),
     .highest = VSHI_LARGEST},
    {.name = "translate",
     .kind = VSHI_VECTOR,
     .offset = offsetof(vsh_sdf_node, translation),
     .count = 3,
     .lowest = -VSHI_LARGEST,
     .highest = VSHI_LARGEST},
    {.name = "rotate_deg",
     .kind = VSHI_CUSTOM,
     .offset = offsetof(vsh_sdf_node, rotation),
     .read = vshi_read_rotation},
    {.name = "rotate_quat",
     .kind = VSHI_VECTOR,
     .offset = offsetof(vsh_sdf_node, rotation),
     .count = 4,
     .lowest = -VSHI_LARGEST,
     .highest = VSHI_LARGEST,
     .flags = VSHI_NONZERO},
    {.name = "scale",
     .kind = VSHI_NUMBER,
     .offset = offsetof(vsh_sdf_node, scale),
     .lowest = 1e-6,
     .highest = 1e6},
};
static const vshi_table node_table = VSHI_TABLE(node_keys);

/* Nodes so far; grown by doubling, since their number is known only at the end. */
typedef struct tree {
    vsh_sdf_node *nodes;
    size_t count;
    size_t capacity;
} tree;

static vsh_result push(vshi_json *reader, const vshi_value *value, tree *t, const vsh_sdf_node *node,
                       int32_t *index) {
    if (t->count == MAX_NODES) {
        return vshi_json_fail(reader, value, "is node %zu of its tree, out of range 1 … %d", t->count + 1,
                              MAX_NODES);
    }
    if (t->count == t->capacity) {
        const size_t capacity = t->capacity == 0 ? 16 : 2 * t->capacity;
        void *nodes;
        VSHI_TRY(vshi_allocate(&nodes, capacity, sizeof *t->nodes, "sdf nodes", reader->error));
        if (t->count > 0) {
            memcpy(nodes, t->nodes, t->count * sizeof *t->nodes);
        }
        free(t->nodes);
        t->nodes = nodes;
        t->capacity = capacity;
    }
    *index = (int32_t)t->count;
    t->nodes[t->count++] = *node;
    return VSH_OK;
}

static vsh_result read_kind(vshi_json *reader, const vshi_value *value, int32_t *shape) {
    VSHI_TRY(vshi_expect(reader, value, JSON_OBJECT));
    VSHI_TRY(vshi_reject_both(reader, value, "shape", "op"));
    int32_t operation = -1;
    *shape = -1;
    VSHI_TRY(vshi_read_choice(reader, value, &(vshi_key){.name = "shape", .name_of = shape_name}, shape));
    VSHI_TRY(
        vshi_read_choice(reader, value, &(vshi_key){.name = "op", .name_of = operation_name}, &operation));
    if (operation >= 0) {
        *shape = VSH_SDF_UNION + operation;
    }
    if (*shape < 0) {
        return vshi_json_fail(reader, value, "key \"shape\" or \"op\" is missing");
    }
    return VSH_OK;
}

/* `scale` is that of the nodes above. */
static vsh_result read_node(vshi_json *reader, const vshi_value *value, tree *t, int level, double scale,
                            int32_t *index) {
    if (level > MAX_LEVELS) {
        return vshi_json_fail(reader, value, "is nested more than %d deep", MAX_LEVELS);
    }
    vsh_sdf_node node = vsh_sdf_node_default();
    VSHI_TRY(read_kind(reader, value, &node.shape));
    if (node.shape == VSH_SDF_CONE) {
        node.minor_radius = 0.0; /* a tip, unless "top_radius" is given */
    }
    VSHI_TRY(vshi_read_object(reader, value, &node_table, BIT(node.shape), shapes[node.shape].what, &node));
    VSHI_TRY(vshi_reject_both(reader, value, "rotate_deg", "rotate_quat"));
    scale *= node.scale;
    if (!(scale >= 1.0 / VSHI_LARGEST && scale <= VSHI_LARGEST)) {
        return vshi_json_fail(reader, value, "the scales of all levels make %.9g, out of range %.9g … %.9g",
                              scale, 1.0 / VSHI_LARGEST, VSHI_LARGEST);
    }
    vshi_value of;
    if (!vshi_member(value, "of", &of)) {
        return push(reader, value, t, &node, index);
    }
    VSHI_TRY(vshi_expect(reader, &of, JSON_ARRAY));
    const size_t size = json_array_size(of.json);
    if (size < 2) {
        return vshi_json_fail(reader, &of, "has %zu items, out of range 2 … %d", size, MAX_NODES);
    }
    /* Folded from the left; the operation's own transform belongs to the last of the pairs alone. */
    vsh_sdf_node pair = vsh_sdf_node_default();
    pair.shape = node.shape;
    pair.smoothing = node.smoothing;
    int32_t left = -1;
    for (size_t i = 0; i < size; ++i) {
        const vshi_value item = vshi_item(&of, i);
        int32_t right;
        VSHI_TRY(read_node(reader, &item, t, level + 1, scale, &right));
        if (i == 0) {
            left = right;
            continue;
        }
        vsh_sdf_node *next = i + 1 < size ? &pair : &node;
        next->left = left;
        next->right = right;
        VSHI_TRY(push(reader, &item, t, next, &left));
    }
    *index = left;
    return VSH_OK;
}

vsh_result vshi_read_sdf(vshi_json *reader, const vshi_value *value, void *member) {
    tree t = {NULL, 0, 0};
    int32_t root;
    void *nodes = NULL;
    vsh_result result = VSH_OK;
    VSHI_TRY_DONE(read_node(reader, value, &t, 1, 1.0, &root));
    VSHI_TRY_DONE(vshi_json_allocate(reader, &nodes, t.count, sizeof *t.nodes, "sdf nodes"));
    memcpy(nodes, t.nodes, t.count * sizeof *t.nodes);
    *(vsh_sdf *)member = (vsh_sdf){nodes, t.count};
done:
    free(t.nodes);
    return result;
}
