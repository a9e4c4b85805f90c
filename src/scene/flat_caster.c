#include "base/elementary.h"
#include "base/try.h"
#include "scene/outline_keys.h"
#include "scene/parts.h"

#include <vdbshade/flat.h>

#include <math.h>

enum {
    MASK = 1 << VSH_FLAT_MASK,
    TEXT = 1 << VSH_FLAT_TEXT,
    CIRCLE = 1 << VSH_FLAT_CIRCLE,
    BOX = 1 << VSH_FLAT_BOX,
    POLYGON = 1 << VSH_FLAT_POLYGON
};

static const char *const whats[] = {"a mask", "a text", "a circle", "a box", "a polygon"};
static const size_t MAX_POINTS = (size_t)1 << 20;

/* Names of the shapes, from VSH_FLAT_CIRCLE on. */
static const char *shape_name(int32_t i) {
    static const char *const names[] = {"circle", "box", "polygon", NULL};
    return names[i];
}

vsh_result vshi_read_mask_size(vshi_json *reader, const vshi_value *value, void *member) {
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

static vsh_result read_points(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_flat_caster *caster = member;
    VSHI_TRY(vshi_expect(reader, value, JSON_ARRAY));
    const size_t count = json_array_size(value->json);
    if (count < 3 || count > MAX_POINTS) {
        return vshi_json_fail(reader, value, "has %zu points, out of range 3 … %zu", count, MAX_POINTS);
    }
    double *points;
    VSHI_TRY(vshi_json_allocate(reader, (void **)&points, count, sizeof(double[2]), "points"));
    const vshi_key key = {.kind = VSHI_VECTOR, .count = 2, .lowest = -VSHI_LARGEST, .highest = VSHI_LARGEST};
    for (size_t i = 0; i < count; ++i) {
        const vshi_value point = vshi_item(value, i);
        VSHI_TRY(vshi_read_value(reader, &point, &key, points + 2 * i));
    }
    caster->points = points;
    caster->point_count = count;
    return VSH_OK;
}

/* What stands between reading and the transform. */
typedef struct placed {
    vsh_flat_caster caster; /* first: its keys' offsets are those of the whole */
    double translate[2];
    double rotate;
    double scale;
} placed;

#define LENGTH(key, bits, member)                                                                            \
    {                                                                                                        \
        .name = key, .kind = VSHI_NUMBER, .variants = bits, .required = bits,                                \
        .offset = offsetof(vsh_flat_caster, member), .highest = VSHI_LARGEST, .flags = VSHI_ABOVE            \
    }

static const vshi_key caster_keys[] = {
    VSHI_OUTLINE_KEYS(vsh_flat_caster, MASK, TEXT),
    {.name = "shape", .kind = VSHI_LATER, .variants = CIRCLE | BOX | POLYGON},
    LENGTH("radius", CIRCLE, radius),
    {.name = "half_size",
     .kind = VSHI_VECTOR,
     .variants = BOX,
     .required = BOX,
     .offset = offsetof(vsh_flat_caster, half_size),
     .count = 2,
     .highest = VSHI_LARGEST,
     .flags = VSHI_ABOVE},
    {.name = "points", .kind = VSHI_CUSTOM, .variants = POLYGON, .required = POLYGON, .read = read_points},
    {.name = "translate",
     .kind = VSHI_VECTOR,
     .offset = offsetof(placed, translate),
     .count = 2,
     .lowest = -VSHI_LARGEST,
     .highest = VSHI_LARGEST},
    {.name = "rotate_deg",
     .kind = VSHI_NUMBER,
     .offset = offsetof(placed, rotate),
     .lowest = -1e6,
     .highest = 1e6},
    {.name = "scale", .kind = VSHI_NUMBER, .offset = offsetof(placed, scale), .lowest = 1e-6, .highest = 1e6},
};
static const vshi_table caster_table = VSHI_TABLE(caster_keys);

static void compose(const placed *p, double m[6]) {
    const double angle = remainder(p->rotate, 360.0) / 180.0 * VSHI_PI;
    const double c = p->scale * vshi_cos(angle), s = p->scale * vshi_sin(angle);
    const double transform[6] = {c, -s, p->translate[0], s, c, p->translate[1]};
    for (int i = 0; i < 6; ++i) {
        m[i] = transform[i];
    }
}

vsh_result vshi_read_flat_caster(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_flat_caster *caster = member;
    placed p = {.scale = 1.0};
    p.caster.mask = vsh_mask_options_default();
    p.caster.letters = vsh_text_options_default();
    vsh_result result = vshi_expect(reader, value, JSON_OBJECT);
    if (result != VSH_OK) {
        return result;
    }
    static const char *const kinds[] = {"mask", "text", "shape"};
    int32_t type = -1;
    for (int32_t i = 0; i < 3; ++i) {
        vshi_value given;
        if (!vshi_member(value, kinds[i], &given)) {
            continue;
        }
        if (type >= 0) {
            return vshi_reject_both(reader, value, kinds[type], kinds[i]);
        }
        type = i;
    }
    if (type == 2) {
        int32_t shape = 0;
        result = vshi_read_choice(reader, value, &(vshi_key){.name = "shape", .name_of = shape_name}, &shape);
        if (result != VSH_OK) {
            return result;
        }
        type = VSH_FLAT_CIRCLE + shape;
    }
    /* A caster of no type still has its keys looked over: the type's name may be what is misspelt. */
    p.caster.type = type;
    result = vshi_read_object(reader, value, &caster_table, type < 0 ? VSHI_ALL : 1U << type,
                              type < 0 ? "a caster" : whats[type], &p);
    if (result != VSH_OK) {
        return result;
    }
    if (type < 0) {
        return vshi_json_fail(reader, value, "key \"mask\", \"text\" or \"shape\" is missing");
    }
    compose(&p, p.caster.transform);
    *caster = p.caster;
    return VSH_OK;
}
