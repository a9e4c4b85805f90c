/* Reads casters from scene files and flat ones: transforms, procedural shapes, and tables of keys. */
#include "base/elementary.h"
#include "base/memory.h"
#include "base/vec.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

/* --- transforms */

/* [x, y, z] degrees into double[4], the quaternion x, y, z, w: about x first, then y, then z, each about the
 * fixed axes (Blender's "XYZ Euler"). */
static vsh_result read_rotation(vshi_json *reader, const vshi_value *value, void *quaternion) {
    const vshi_key key = {.kind = VSHI_VECTOR, .count = 3, .lowest = -1e6, .highest = 1e6};
    double degrees[3];
    VSHI_TRY(vshi_read_value(reader, value, &key, degrees));
    double s[3], c[3];
    for (int i = 0; i < 3; ++i) {
        const double half = remainder(degrees[i], 720.0) / 360.0 * VSHI_PI;
        s[i] = vshi_sin(half);
        c[i] = vshi_cos(half);
    }
    /* The product of the quaternions about z, y, x, as they act on a vector from the right. */
    double *q = quaternion;
    q[0] = s[0] * c[1] * c[2] - c[0] * s[1] * s[2];
    q[1] = c[0] * s[1] * c[2] + s[0] * c[1] * s[2];
    q[2] = c[0] * c[1] * s[2] - s[0] * s[1] * c[2];
    q[3] = c[0] * c[1] * c[2] + s[0] * s[1] * s[2];
    return VSH_OK;
}

/* One number for all axes, or one for each. */
static vsh_result read_scale(vshi_json *reader, const vshi_value *value, void *member) {
    const vshi_key key = {.kind = json_is_array(value->json) ? VSHI_VECTOR : VSHI_NUMBER,
                          .count = 3,
                          .lowest = 1e-6,
                          .highest = 1e6};
    double *scale = member;
    VSHI_TRY(vshi_read_value(reader, value, &key, scale));
    if (key.kind == VSHI_NUMBER) {
        scale[1] = scale[2] = scale[0];
    }
    return VSH_OK;
}

typedef struct parts {
    double translate[3];
    double rotation[4];
    double scale[3];
    double matrix[12];
} parts;

#define AT(member) .offset = offsetof(parts, member)
static const vshi_key transform_keys[] = {
    VSHI_KEY("translate", VECTOR, AT(translate), .count = 3, VSHI_ANY),
    VSHI_KEY("rotate_deg", CUSTOM, AT(rotation), .read = read_rotation),
    VSHI_KEY("rotate_quat", VECTOR, AT(rotation), .count = 4, .flags = VSHI_NONZERO, VSHI_ANY),
    VSHI_KEY("scale", CUSTOM, AT(scale), .read = read_scale),
    VSHI_KEY("matrix", VECTOR, AT(matrix), .count = 12, VSHI_ANY),
};
static const vshi_table transform_table = VSHI_TABLE(transform_keys);
#undef AT

/* Scale, then rotation, then translation. */
static void compose(const parts *p, double m[12]) {
    double q[4];
    double largest = 0.0;
    for (int i = 0; i < 4; ++i) {
        largest = fmax(largest, fabs(p->rotation[i]));
    }
    for (int i = 0; i < 4; ++i) {
        q[i] = p->rotation[i] / largest;
    }
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    const double length2 = x * x + y * y + z * z + w * w;
    const double rotation[9] = {
        w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z),         2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),         w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),         2.0 * (y * z + w * x),         w * w - x * x - y * y + z * z,
    };
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            m[row * 4 + column] = rotation[row * 3 + column] / length2 * p->scale[column];
        }
        m[row * 4 + 3] = p->translate[row];
    }
}

vsh_result vshi_read_transform(vshi_json *reader, const vshi_value *value, void *matrix) {
    parts p = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 1.0}, {1.0, 1.0, 1.0}, {0.0}};
    VSHI_TRY(vshi_read_object(reader, value, &transform_table, 1, "a transform", &p));
    VSHI_TRY(vshi_reject_both(reader, value, "rotate_deg", "rotate_quat"));
    static const char *const other[] = {"translate", "rotate_deg", "rotate_quat", "scale"};
    for (size_t i = 0; i < sizeof other / sizeof other[0]; ++i) {
        VSHI_TRY(vshi_reject_both(reader, value, "matrix", other[i]));
    }
    double *m = matrix;
    vshi_value given;
    if (!vshi_member(value, "matrix", &given)) {
        compose(&p, m);
        return VSH_OK;
    }
    memcpy(m, p.matrix, sizeof p.matrix);
    if (vshi_transform_flattens(m)) {
        return vshi_json_fail(reader, &given, "flattens: the determinant of its first three columns is 0");
    }
    return VSH_OK;
}

/* --- procedural shapes */

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

#define AT(member) .offset = offsetof(vsh_sdf_node, member)
static const vshi_key node_keys[] = {
    VSHI_KEY("shape", LATER, .variants = ~OPERATIONS),
    VSHI_KEY("op", LATER, .variants = OPERATIONS),
    VSHI_KEY("of", LATER, VSHI_NEEDED_BY(OPERATIONS)),
    VSHI_KEY("radius", NUMBER, AT(radius), VSHI_NEEDED_BY(ROUND), VSHI_POSITIVE),
    VSHI_KEY("tube_radius", NUMBER, AT(minor_radius), VSHI_NEEDED_BY(BIT(VSH_SDF_TORUS)), VSHI_POSITIVE),
    VSHI_KEY("half_height", NUMBER, AT(size[1]), VSHI_NEEDED_BY(TALL), VSHI_POSITIVE),
    VSHI_KEY("thickness", NUMBER, AT(size[1]), VSHI_NEEDED_BY(BIT(VSH_SDF_PLANE)), VSHI_POSITIVE),
    VSHI_KEY("smoothing", NUMBER, AT(smoothing), VSHI_NEEDED_BY(BIT(VSH_SDF_SMOOTH_UNION)), VSHI_POSITIVE),
    VSHI_KEY("half_size", VECTOR, AT(size), VSHI_NEEDED_BY(BIT(VSH_SDF_BOX)), .count = 3, VSHI_POSITIVE),
    VSHI_KEY("half_size", CUSTOM, AT(size), VSHI_NEEDED_BY(BIT(VSH_SDF_PLANE)), .read = read_plane_size),
    VSHI_KEY("rounding", NUMBER, AT(rounding), .variants = BIT(VSH_SDF_BOX), .highest = VSHI_LARGEST),
    VSHI_KEY("top_radius", NUMBER, AT(minor_radius), .variants = BIT(VSH_SDF_CONE), .highest = VSHI_LARGEST),
    VSHI_KEY("translate", VECTOR, AT(translation), .count = 3, VSHI_ANY),
    VSHI_KEY("rotate_deg", CUSTOM, AT(rotation), .read = read_rotation),
    VSHI_KEY("rotate_quat", VECTOR, AT(rotation), .count = 4, .flags = VSHI_NONZERO, VSHI_ANY),
    VSHI_KEY("scale", NUMBER, AT(scale), .lowest = 1e-6, .highest = 1e6),
};
static const vshi_table node_table = VSHI_TABLE(node_keys);
#undef AT

typedef struct tree {
    vsh_sdf_node *nodes; /* [count] */
    size_t count, capacity;
} tree;

static vsh_result add_node(vshi_json *reader, const vshi_value *value, tree *t, const vsh_sdf_node *node,
                           int32_t *index) {
    if (t->count == MAX_NODES) {
        return vshi_json_fail(reader, value, "is node %zu of its tree, out of range 1 … %d", t->count + 1,
                              MAX_NODES);
    }
    VSHI_TRY(vshi_make_room((void **)&t->nodes, t->count, &t->capacity, sizeof *t->nodes, "sdf nodes",
                            reader->error));
    *index = (int32_t)t->count;
    t->nodes[t->count++] = *node;
    return VSH_OK;
}

static vsh_result read_kind(vshi_json *reader, const vshi_value *value, vsh_sdf_shape *shape) {
    VSHI_TRY(vshi_expect(reader, value, JSON_OBJECT));
    VSHI_TRY(vshi_reject_both(reader, value, "shape", "op"));
    int32_t operation = -1, plain = -1;
    VSHI_TRY(vshi_read_choice(reader, value, &(vshi_key){.name = "shape", .name_of = shape_name}, &plain));
    VSHI_TRY(
        vshi_read_choice(reader, value, &(vshi_key){.name = "op", .name_of = operation_name}, &operation));
    if (operation < 0 && plain < 0) {
        return vshi_json_fail(reader, value, "key \"shape\" or \"op\" is missing");
    }
    *shape = operation >= 0 ? VSH_SDF_UNION + operation : plain;
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
        return add_node(reader, value, t, &node, index);
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
        VSHI_TRY(add_node(reader, &item, t, next, &left));
    }
    *index = left;
    return VSH_OK;
}

/* Reads nested objects into the plain array of nodes of a vsh_sdf. */
static vsh_result read_sdf(vshi_json *reader, const vshi_value *value, void *member) {
    tree t = {NULL, 0, 0};
    int32_t root;
    void *nodes = NULL;
    vsh_result result;
    VSHI_TRY_DONE(read_node(reader, value, &t, 1, 1.0, &root));
    VSHI_TRY_DONE(vshi_json_allocate(reader, &nodes, t.count, sizeof *t.nodes, "sdf nodes"));
    memcpy(nodes, t.nodes, t.count * sizeof *t.nodes);
    *(vsh_sdf *)member = (vsh_sdf){nodes, t.count};
done:
    free(t.nodes);
    return result;
}

/* --- patterns of names */

vsh_result vshi_read_patterns(vshi_json *reader, const vshi_value *value, void *member) {
    static const vshi_key key = {.kind = VSHI_STRING};
    const bool array = json_is_array(value->json);
    const size_t count = array ? json_array_size(value->json) : 1;
    const char **strings;
    if (count == 0) {
        return vshi_json_fail(reader, value, "is empty");
    }
    VSHI_TRY(vshi_json_allocate(reader, (void **)&strings, count, sizeof *strings, "patterns"));
    for (size_t i = 0; i < count; ++i) {
        const vshi_value item = array ? vshi_item(value, i) : *value;
        VSHI_TRY(vshi_read_value(reader, &item, &key, &strings[i]));
    }
    memcpy(member, &(vshi_list){strings, count}, sizeof(vshi_list));
    return VSH_OK;
}
#define PAIR(type, patterns, count) (offsetof(type, count) == offsetof(type, patterns) + sizeof(void *))
_Static_assert(PAIR(vsh_selection, only, only_count) && PAIR(vsh_selection, except, except_count) &&
                   PAIR(vsh_caster, one_sided, one_sided_count),
               "patterns are as vshi_list");

/* Adds patterns to a caster's rules of solidity. The key is the solidity of their meshes. */
static vsh_result read_rules(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_caster *caster = member;
    const int32_t solidity = strcmp(value->key, "solid") == 0   ? VSH_SOLIDITY_SOLID
                             : strcmp(value->key, "shell") == 0 ? VSH_SOLIDITY_SHELL
                                                                : VSH_SOLIDITY_INWARD;
    vsh_selection given = {.only = NULL};
    VSHI_TRY(vshi_read_patterns(reader, value, &given));
    const size_t count = caster->solidity_count + given.only_count;
    vsh_solidity_rule *rules;
    VSHI_TRY(vshi_json_allocate(reader, (void **)&rules, count, sizeof *rules, "patterns"));
    for (size_t i = 0; i < count; ++i) {
        rules[i] = i < caster->solidity_count
                       ? caster->solidity[i]
                       : (vsh_solidity_rule){given.only[i - caster->solidity_count], solidity};
    }
    caster->solidity = rules;
    caster->solidity_count = count;
    return VSH_OK;
}

/* --- masks and texts, as solids and in a plane */

/* `size` of a mask, one number or two. */
static vsh_result read_mask_size(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_mask_options *mask = member;
    const vshi_key key = {.kind = json_is_array(value->json) ? VSHI_VECTOR : VSHI_NUMBER,
                          .count = 2,
                          .highest = VSHI_LARGEST,
                          .flags = VSHI_ABOVE};
    double size[2] = {0.0, 0.0}; /* a height of 0: by the image's proportions */
    const vsh_result result = vshi_read_value(reader, value, &key, size);
    mask->width = size[0];
    mask->height = size[1];
    return result;
}

/* Rows for a struct with path, text, mask and letters, which hold the options' defaults. `of_mask` and
 * `of_text` are the bits of the two variants. */
#define VSHI_OUTLINE_KEYS(target, of_mask, of_text)                                                          \
    VSHI_KEY("mask", PATH, .variants = of_mask, .offset = offsetof(target, path)),                           \
        VSHI_KEY("size", CUSTOM, VSHI_NEEDED_BY(of_mask), .offset = offsetof(target, mask),                  \
                 .read = read_mask_size),                                                                    \
        VSHI_KEY("channel", STRING, .variants = of_mask, .offset = offsetof(target, mask.channel)),          \
        VSHI_KEY("threshold", NUMBER, .variants = of_mask, .offset = offsetof(target, mask.threshold),       \
                 VSHI_ANY),                                                                                  \
        VSHI_KEY("invert", BOOL, .variants = of_mask, .offset = offsetof(target, mask.invert)),              \
        VSHI_KEY("text", STRING, .variants = of_text, .offset = offsetof(target, text)),                     \
        VSHI_KEY("font", PATH, VSHI_NEEDED_BY(of_text), .offset = offsetof(target, path)),                   \
        VSHI_KEY("height", NUMBER, VSHI_NEEDED_BY(of_text), .offset = offsetof(target, letters.height),      \
                 VSHI_POSITIVE),                                                                             \
        VSHI_KEY("line_spacing", NUMBER, .variants = of_text,                                                \
                 .offset = offsetof(target, letters.line_spacing), .highest = 1e3, .flags = VSHI_ABOVE),     \
        VSHI_KEY("align", NAME, .variants = of_text, .offset = offsetof(target, letters.align),              \
                 .names = VSH_NAMES_ALIGN)

/* --- casters */

enum {
    MESH = 1 << VSH_CASTER_MESH,
    SDF = 1 << VSH_CASTER_SDF,
    VDB = 1 << VSH_CASTER_VDB,
    HEIGHTFIELD = 1 << VSH_CASTER_HEIGHTFIELD,
    SPHERES = 1 << VSH_CASTER_SPHERES,
    MASK = 1 << VSH_CASTER_MASK,
    TEXT = 1 << VSH_CASTER_TEXT
};

/* The key that gives a caster each type, which is also the type's name in messages. */
static const char *const keys[] = {[VSH_CASTER_MESH] = "mesh",       [VSH_CASTER_SDF] = "sdf",
                                   [VSH_CASTER_VDB] = "vdb",         [VSH_CASTER_HEIGHTFIELD] = "heightfield",
                                   [VSH_CASTER_SPHERES] = "spheres", [VSH_CASTER_MASK] = "mask",
                                   [VSH_CASTER_TEXT] = "text"};
static const char *const whats[] = {[VSH_CASTER_MESH] = "a mesh caster",
                                    [VSH_CASTER_SDF] = "an sdf caster",
                                    [VSH_CASTER_VDB] = "a vdb caster",
                                    [VSH_CASTER_HEIGHTFIELD] = "a heightfield caster",
                                    [VSH_CASTER_SPHERES] = "a caster of spheres",
                                    [VSH_CASTER_MASK] = "a mask caster",
                                    [VSH_CASTER_TEXT] = "a text caster"};

vsh_result vshi_read_type(vshi_json *reader, const vshi_value *object, const char *const *names,
                          int32_t count, int32_t *type) {
    vshi_value given;
    *type = -1;
    for (int32_t i = 0; i < count; ++i) {
        if (!vshi_member(object, names[i], &given)) {
            continue;
        }
        if (*type >= 0) {
            return vshi_reject_both(reader, object, names[*type], names[i]);
        }
        *type = i;
    }
    return VSH_OK;
}

/* A file's name, or [[x, y, z, radius], …]. */
static vsh_result read_spheres(vshi_json *reader, const vshi_value *value, void *member) {
    static const vshi_key path = {.kind = VSHI_PATH};
    vsh_caster *caster = member;
    if (json_is_string(value->json)) {
        return vshi_read_value(reader, value, &path, &caster->path);
    }
    if (!json_is_array(value->json)) {
        return vshi_json_fail(reader, value, "expected a file's name or an array of [x, y, z, radius]");
    }
    caster->sphere_count = json_array_size(value->json);
    if (caster->sphere_count == 0) {
        return vshi_json_fail(reader, value, "is empty");
    }
    static const vshi_key row = {.kind = VSHI_VECTOR, .count = 4, VSHI_ANY};
    double *spheres;
    VSHI_TRY(
        vshi_json_allocate(reader, (void **)&spheres, caster->sphere_count, 4 * sizeof *spheres, "spheres"));
    caster->spheres = spheres;
    for (size_t i = 0; i < caster->sphere_count; ++i) {
        const vshi_value item = vshi_item(value, i);
        VSHI_TRY(vshi_read_value(reader, &item, &row, spheres + 4 * i));
        if (!(spheres[4 * i + 3] > 0.0)) {
            const vshi_value radius = vshi_item(&item, 3);
            return vshi_json_fail(reader, &radius, "%.9g is out of range 0 (excluded) … %.9g",
                                  caster->spheres[4 * i + 3], VSHI_LARGEST);
        }
    }
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

#define AT(member) .offset = offsetof(vsh_caster, member)
static const vshi_key caster_keys[] = {
    VSHI_KEY("mesh", PATH, AT(path), .variants = MESH),
    VSHI_KEY("objects", CUSTOM, AT(objects.only), .variants = MESH, .read = vshi_read_patterns),
    VSHI_KEY("except", CUSTOM, AT(objects.except), .variants = MESH, .read = vshi_read_patterns),
    VSHI_KEY("solid", CUSTOM, .variants = MESH, .read = read_rules),
    VSHI_KEY("shell", CUSTOM, .variants = MESH, .read = read_rules),
    VSHI_KEY("inward", CUSTOM, .variants = MESH, .read = read_rules),
    VSHI_KEY("one_sided", CUSTOM, AT(one_sided), .variants = MESH, .read = vshi_read_patterns),
    VSHI_KEY("sdf", CUSTOM, AT(sdf), .variants = SDF, .read = read_sdf),
    VSHI_KEY("vdb", CUSTOM, .variants = VDB, .read = read_vdb),
    VSHI_KEY("grid", STRING, AT(grid), .variants = VDB),
    VSHI_KEY("heightfield", PATH, AT(path), .variants = HEIGHTFIELD),
    VSHI_KEY("extent", VECTOR, AT(size), .variants = HEIGHTFIELD, .count = 2, .lowest = 1e-12,
             .highest = 1e12),
    /* the old name of "extent" */
    VSHI_KEY("size", VECTOR, AT(size), .variants = HEIGHTFIELD, .count = 2, .lowest = 1e-12, .highest = 1e12),
    VSHI_KEY("height", NUMBER, AT(height), VSHI_NEEDED_BY(HEIGHTFIELD), .lowest = -1e12, .highest = 1e12),
    VSHI_KEY("base", NUMBER, AT(base), .variants = HEIGHTFIELD, .highest = 1e12, .flags = VSHI_ABOVE),
    VSHI_KEY("direct", BOOL, AT(direct), .variants = HEIGHTFIELD),
    VSHI_KEY("spheres", CUSTOM, .variants = SPHERES, .read = read_spheres),
    VSHI_KEY("voxelised", BOOL, AT(voxelised), .variants = SPHERES),
    VSHI_KEY("transform", CUSTOM, AT(transform), .read = vshi_read_transform),
    VSHI_KEY("layer", STRING, AT(layer)),
    VSHI_KEY("color", VECTOR, AT(color), .highest = 1.0, .flags = VSHI_NONZERO, .count = 3),
    VSHI_OUTLINE_KEYS(vsh_caster, MASK, TEXT),
    VSHI_KEY("thickness", NUMBER, AT(thickness), VSHI_NEEDED_BY(MASK | TEXT), VSHI_POSITIVE),
};
static const vshi_table caster_table = VSHI_TABLE(caster_keys);
#undef AT

vsh_result vshi_read_caster(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_caster *caster = member;
    *caster = vsh_caster_default();
    VSHI_TRY(vshi_expect(reader, value, JSON_OBJECT));
    vshi_value transform;
    int32_t type;
    VSHI_TRY(vshi_read_type(reader, value, keys, sizeof keys / sizeof keys[0], &type));
    caster->type = type;
    /* keys are checked even without a type, whose name may be misspelt */
    const uint32_t variant = type < 0 ? VSHI_ALL : 1U << type;
    VSHI_TRY(
        vshi_read_object(reader, value, &caster_table, variant, type < 0 ? "a caster" : whats[type], caster));
    if (type < 0) {
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
    if (caster->type != VSH_CASTER_MESH && vshi_similarity_scale(caster->transform) <= 0.0 &&
        vshi_member(value, "transform", &transform)) {
        return vshi_json_fail(reader, &transform, "shears or scales unevenly, which %s cannot",
                              whats[caster->type]);
    }
    return VSH_OK;
}

/* --- flat casters */

enum { FLAT_MASK = 1 << VSH_FLAT_MASK, FLAT_TEXT = 1 << VSH_FLAT_TEXT, BOX = 1 << VSH_FLAT_BOX };

static const char *flat_shape_name(int32_t i) {
    return i == 0 ? "box" : NULL;
}

/* A caster, and the numbers that make its transform. */
typedef struct placed {
    vsh_flat_caster caster; /* first: its keys' offsets are those of the whole */
    double translate[2];
    double rotate;
    double scale;
} placed;

#define AT(member) .offset = offsetof(placed, member)
static const vshi_key flat_keys[] = {
    VSHI_OUTLINE_KEYS(vsh_flat_caster, FLAT_MASK, FLAT_TEXT),
    VSHI_KEY("shape", LATER, .variants = BOX),
    VSHI_KEY("half_size", VECTOR, AT(caster.half_size), VSHI_NEEDED_BY(BOX), .count = 2, VSHI_POSITIVE),
    VSHI_KEY("translate", VECTOR, AT(translate), .count = 2, VSHI_ANY),
    VSHI_KEY("rotate_deg", NUMBER, AT(rotate), .lowest = -1e6, .highest = 1e6),
    VSHI_KEY("scale", NUMBER, AT(scale), .lowest = 1e-6, .highest = 1e6),
};
static const vshi_table flat_table = VSHI_TABLE(flat_keys);
#undef AT

static void compose_flat(const placed *p, double m[6]) {
    const double angle = remainder(p->rotate, 360.0) / 180.0 * VSHI_PI;
    const double c = p->scale * vshi_cos(angle), s = p->scale * vshi_sin(angle);
    const double transform[6] = {c, -s, p->translate[0], s, c, p->translate[1]};
    memcpy(m, transform, sizeof transform);
}

vsh_result vshi_read_flat_caster(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_flat_caster *caster = member;
    placed p = {.scale = 1.0};
    p.caster.mask = vsh_mask_options_default();
    p.caster.letters = vsh_text_options_default();
    VSHI_TRY(vshi_expect(reader, value, JSON_OBJECT));
    static const char *const kinds[] = {"mask", "text", "shape"};
    static const char *const flat_whats[] = {"a mask", "a text", "a box"};
    int32_t type;
    VSHI_TRY(vshi_read_type(reader, value, kinds, 3, &type));
    if (type == VSH_FLAT_BOX) {
        static const vshi_key shape = {.name = "shape", .name_of = flat_shape_name};
        int32_t box;
        VSHI_TRY(vshi_read_choice(reader, value, &shape, &box));
    }
    /* keys are checked even without a type, whose name may be misspelt */
    p.caster.type = type;
    VSHI_TRY(vshi_read_object(reader, value, &flat_table, type < 0 ? VSHI_ALL : 1U << type,
                              type < 0 ? "a caster" : flat_whats[type], &p));
    if (type < 0) {
        return vshi_json_fail(reader, value, "key \"mask\", \"text\" or \"shape\" is missing");
    }
    compose_flat(&p, p.caster.transform);
    *caster = p.caster;
    return VSH_OK;
}
