#include "cli/json_values.h"
#include "cli/study_analyse.h"

static bool add(json_t *list, json_t *object) { return object && json_array_append_new(list, object) == 0; }

static json_t *scenario_json(const ca_study_asked *asked, const ca_study_ratio *r)
{
    return json_pack("{s:s, s:s, s:s, s:i, s:i, s:i, s:o, s:f, s:f, s:f}", "name", asked->name, "light",
                     asked->light_name, "pair", asked->pair, "yes", (int)r->yes, "answers", (int)r->total, "left_out",
                     (int)r->left_out, "ratio", ca_json_number(r->ratio), "low", r->low, "high", r->high, "flip",
                     asked->flip);
}

static json_t *pair_json(const ca_study_answers *answers, const ca_study_pair *p)
{
    return json_pack("{s:s, s:s, s:s, s:i, s:i, s:i, s:i, s:f, s:f}", "name", p->name, "visible",
                     answers->scenarios[p->visible].name, "occluded", answers->scenarios[p->occluded].name,
                     "only_occluded", (int)p->only_occluded, "only_visible", (int)p->only_visible, "both",
                     (int)p->both, "neither", (int)p->neither, "p_more", p->more, "p_two_sided", p->two_sided);
}

/* NULL: out of memory. */
static json_t *analysis_json(const ca_study_analysis *a)
{
    json_t *scenarios = json_array(), *pairs = json_array();
    bool complete = scenarios && pairs;
    for (uint32_t k = 0; complete && k < a->answers->scenario_count; k++)
        complete = add(scenarios, scenario_json(&a->answers->scenarios[k], &a->ratios[k]));
    for (uint32_t i = 0; complete && i < a->pair_count; i++)
        complete = add(pairs, pair_json(a->answers, &a->pairs[i]));
    json_t *root =
        complete
            ? json_pack("{s:s, s:s, s:s, s:i, s:i, s:i, s:O, s:O, s:{s:i, s:i, s:i, s:f, s:f}}", "study",
                        a->answers->id, "title", a->answers->title, "question", a->answers->question, "subjects",
                        (int)a->subjects, "unfinished", (int)a->unfinished, "left_out", (int)a->left_out, "scenarios",
                        scenarios, "pairs", pairs, "all_pairs", "more", (int)a->saw_more, "fewer", (int)a->saw_fewer,
                        "as_many", (int)a->saw_as_many, "p_more", a->more, "p_two_sided", a->two_sided)
            : NULL;
    json_decref(scenarios);
    json_decref(pairs);
    return root;
}

ca_status ca_study_write_json(const char *path, const ca_study_analysis *analysis, ca_error *error)
{
    ca_json_begin();
    return ca_json_write(path, analysis_json(analysis), true, error);
}
