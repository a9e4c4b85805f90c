/* A comparison as JSON. */
#include "cli/document.h"
#include "comparison.h"

#include <math.h>

static json_t *number(double value) {
    return isfinite(value) ? json_real(value) : json_null();
}

static json_t *place(const vsh_channel_comparison *channel, uint64_t index) {
    const uint64_t width = (uint64_t)channel->size[0], height = (uint64_t)channel->size[1];
    const json_int_t x = (json_int_t)(index % width), y = (json_int_t)(index / width % height);
    const json_int_t z = (json_int_t)(index / width / height);
    return json_pack("[I,I,I]", x + channel->origin[0], y + channel->origin[1], z + channel->origin[2]);
}

static json_t *region(const vsh_channel_comparison *channel, const vsh_region *r) {
    if (r->count == 0) {
        return json_null();
    }
    json_t *min = json_array(), *max = json_array();
    for (int axis = 0; axis < 3; ++axis) {
        json_array_append_new(min, json_integer(r->min[axis] + channel->origin[axis]));
        json_array_append_new(max, json_integer(r->max[axis] + channel->origin[axis]));
    }
    return json_pack("{s:I,s:o,s:f,s:o,s:o}", "texels", (json_int_t)r->count, "worst",
                     place(channel, r->worst), "by", r->by, "min", min, "max", max);
}

static json_t *nonfinite(const vsh_channel_comparison *channel, int which) {
    const vsh_measures *m = &channel->measures;
    return json_pack("{s:I,s:o}", "count", (json_int_t)m->nonfinite[which], "first",
                     m->nonfinite[which] > 0 ? place(channel, m->nonfinite_first[which]) : json_null());
}

static void set_measures(json_t *root, const vsh_channel_comparison *channel) {
    const vsh_measures *m = &channel->measures;
    json_t *values = json_object(), *limits = json_object(), *failed = json_array();
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        const char *name = vsh_measure_name(i);
        json_object_set_new(values, name, number(m->value[i]));
        json_object_set_new(limits, name, number(channel->limits.value[i]));
        if ((channel->failed >> i & 1) != 0) {
            json_array_append_new(failed, json_string(name));
        }
    }
    json_object_set_new(root, "compared", json_integer((json_int_t)m->count));
    json_object_set_new(root, "range", number(m->range));
    json_object_set_new(root, "max_error",
                        json_pack("[o,o]", number(channel->max_error[0]), number(channel->max_error[1])));
    json_object_set_new(root, "noise", number(channel->limits.options.noise));
    json_object_set_new(root, "failed", failed);
    json_object_set_new(root, "measures", values);
    json_object_set_new(root, "limits", limits);
    json_object_set_new(root, "golden_nonfinite", nonfinite(channel, 0));
    json_object_set_new(root, "new_nonfinite", nonfinite(channel, 1));
    if (m->count == 0) {
        return;
    }
    json_object_set_new(root, "bias", number(m->bias));
    json_object_set_new(root, "worst",
                        json_pack("{s:o,s:o,s:o}", "at", place(channel, m->worst), "golden",
                                  number(m->worst_value[0]), "new", number(m->worst_value[1])));
    json_object_set_new(root, "edges",
                        json_pack("{s:I,s:I,s:I}", "golden", (json_int_t)m->edges[0], "new",
                                  (json_int_t)m->edges[1], "pairs", (json_int_t)m->pairs));
    json_object_set_new(root, "penumbra_width",
                        json_pack("{s:o,s:o}", "golden", number(m->width[0]), "new", number(m->width[1])));
    json_object_set_new(root, "shift", json_pack("[f,f,f]", m->shift[0], m->shift[1], m->shift[2]));
    json_object_set_new(root, "shift_explains", number(m->explained));
    json_object_set_new(root, "measured_noise", number(m->noise));
    json_object_set_new(root, "noise_explains", number(m->noise_share));
    json_object_set_new(root, "curve",
                        m->curve[2][0] > 0.0
                            ? json_pack("[[f,f],[f,f],[f,f]]", m->curve[0][0], m->curve[0][1], m->curve[1][0],
                                        m->curve[1][1], m->curve[2][0], m->curve[2][1])
                            : json_null());
    json_object_set_new(root, "lost", region(channel, &m->lost));
    json_object_set_new(root, "gained", region(channel, &m->gained));
}

static json_t *coverage(const vsh_channel_comparison *channel) {
    const vsh_coverage *c = &channel->coverage;
    return json_pack("{s:I,s:I,s:I,s:f,s:f}", "golden", (json_int_t)c->golden, "new", (json_int_t)c->values,
                     "differs", (json_int_t)c->differs, "share", c->share, "limit", channel->coverage_limit);
}

static json_t *describe(const vsh_channel_comparison *channel) {
    char what[2048];
    cli_channel_explain(channel, what, sizeof what);
    json_t *root = json_pack("{s:o,s:b,s:o}", "name", cli_utf8_json(channel->name), "alike", channel->alike,
                             "what", cli_utf8_json(what));
    if (root != NULL && (channel->is_coverage || channel->coverage.golden + channel->coverage.values > 0)) {
        json_object_set_new(root, "coverage", coverage(channel));
    }
    if (root != NULL && !channel->is_coverage) {
        set_measures(root, channel);
    }
    return root;
}

static json_t *path(const char *name) {
    return name != NULL ? cli_utf8_json(name) : json_null();
}

json_t *cli_comparison_json(const cli_comparison *c) {
    json_t *problems = json_array(), *channels = json_array();
    const char *problem;
    const vsh_channel_comparison *channel;
    for (size_t i = 0; (problem = cli_comparison_problem(c, i)) != NULL; ++i) {
        json_array_append_new(problems, cli_utf8_json(problem));
    }
    for (size_t i = 0; (channel = vsh_comparison_channel(c->made, i)) != NULL; ++i) {
        json_array_append_new(channels, describe(channel));
    }
    return json_pack("{s:o,s:o,s:b,s:o,s:o}", "golden", path(c->golden), "new", path(c->fresh), "alike",
                     c->alike, "problems", problems, "channels", channels);
}
