#include "cli/study_analyse.h"

#include "base/memory.h"
#include "base/text.h"
#include "cli/say.h"
#include "metrics/binomial.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- Counting -------------------------------------------------------------------------------------------------- */

static void count_scenario(const ca_study_answers *answers, uint32_t scenario, ca_study_ratio *r)
{
    for (size_t i = 0; i < answers->subject_count; i++) {
        if (!answers->subjects[i].finished) continue;
        const ca_study_answer answer = answers->subjects[i].answers[scenario];
        r->yes += answer == CA_STUDY_YES;
        r->total += answer == CA_STUDY_YES || answer == CA_STUDY_NO;
        r->left_out += answer == CA_STUDY_LEFT_OUT;
    }
    r->ratio = r->total > 0 ? (double)r->yes / r->total : (double)NAN;
    ca_clopper_pearson(r->yes, r->total, CA_STUDY_ALPHA, &r->low, &r->high);
}

static bool is_answered(ca_study_answer answer) { return answer == CA_STUDY_YES || answer == CA_STUDY_NO; }

/* -1, 0 or 1: did the subject see a difference with a visible light only, in both or none, with an occluded light
 * only? Nothing of a subject without both answers. */
static int compare_pair(const ca_study_subject *s, const ca_study_pair *pair)
{
    const ca_study_answer occluded = s->answers[pair->occluded], visible = s->answers[pair->visible];
    if (!is_answered(occluded) || !is_answered(visible)) return 0;
    return (occluded == CA_STUDY_YES) - (visible == CA_STUDY_YES);
}

static void count_pair(const ca_study_answers *answers, ca_study_pair *pair)
{
    for (size_t i = 0; i < answers->subject_count; i++) {
        const ca_study_subject *s = &answers->subjects[i];
        const ca_study_answer occluded = s->answers[pair->occluded], visible = s->answers[pair->visible];
        if (!s->finished || !is_answered(occluded) || !is_answered(visible)) continue;
        const int difference = compare_pair(s, pair);
        pair->only_occluded += difference > 0;
        pair->only_visible += difference < 0;
        pair->both += difference == 0 && occluded == CA_STUDY_YES;
        pair->neither += difference == 0 && occluded == CA_STUDY_NO;
    }
    pair->two_sided = ca_sign_test_two_sided(pair->only_occluded, pair->only_visible);
    pair->more = ca_sign_test_more(pair->only_occluded, pair->only_visible);
}

static void find_pairs(ca_study_analysis *a)
{
    const ca_study_asked *scenarios = a->answers->scenarios;
    for (uint32_t v = 0; v < a->answers->scenario_count; v++)
        for (uint32_t o = 0; o < a->answers->scenario_count; o++) {
            if (scenarios[v].light != CA_STUDY_LIGHT_VISIBLE || scenarios[o].light != CA_STUDY_LIGHT_OCCLUDED)
                continue;
            if (strcmp(scenarios[v].pair, scenarios[o].pair) != 0) continue;
            ca_study_pair *pair = &a->pairs[a->pair_count++];
            *pair = (ca_study_pair){.name = scenarios[v].pair, .visible = v, .occluded = o};
            count_pair(a->answers, pair);
            break; /* of a second one of the same light the study's file is refused */
        }
}

/* A subject's answers depend on each other: each counts once, by the sign of all pairs together. */
static void count_subjects(ca_study_analysis *a)
{
    for (size_t i = 0; i < a->answers->subject_count; i++) {
        const ca_study_subject *s = &a->answers->subjects[i];
        if (!s->finished) {
            a->unfinished++;
            continue;
        }
        int sum = 0;
        for (uint32_t k = 0; k < a->pair_count; k++) sum += compare_pair(s, &a->pairs[k]);
        a->subjects++;
        a->saw_more += sum > 0;
        a->saw_fewer += sum < 0;
        a->saw_as_many += sum == 0;
    }
    a->two_sided = ca_sign_test_two_sided(a->saw_more, a->saw_fewer);
    a->more = ca_sign_test_more(a->saw_more, a->saw_fewer);
}

ca_status ca_study_analyse(const ca_study_answers *answers, ca_study_analysis *analysis, ca_error *error)
{
    ca_study_analysis *a = analysis;
    *a = (ca_study_analysis){
        .answers = answers,
        .ratios = ca_alloc_zeroed(answers->scenario_count, sizeof *a->ratios),
        .pairs = ca_alloc_zeroed(answers->scenario_count, sizeof *a->pairs),
    };
    if (!a->ratios || !a->pairs) return ca_fail_memory(error, "the analysis");
    for (uint32_t k = 0; k < answers->scenario_count; k++) {
        count_scenario(answers, k, &a->ratios[k]);
        a->left_out += a->ratios[k].left_out;
    }
    find_pairs(a);
    count_subjects(a);
    if (a->subjects > 0) return CA_OK;
    return ca_fail(error, CA_ERROR_FORMAT, NULL, "there is no session that was finished");
}

void ca_study_analysis_destroy(ca_study_analysis *analysis)
{
    ca_free(analysis->ratios);
    ca_free(analysis->pairs);
    *analysis = (ca_study_analysis){0};
}

/* ---- Printing -------------------------------------------------------------------------------------------------- */

static void print_scenarios(const ca_study_analysis *a)
{
    size_t width = sizeof "scenario" - 1;
    for (uint32_t k = 0; k < a->answers->scenario_count; k++) {
        const size_t length = strlen(a->answers->scenarios[k].name);
        if (length > width) width = length;
    }
    printf("%-*s  saw a difference  ratio  95 %% interval   FLIP\n", (int)width, "scenario");
    for (uint32_t k = 0; k < a->answers->scenario_count; k++) {
        const ca_study_ratio *r = &a->ratios[k];
        char seen[32];
        snprintf(seen, sizeof seen, "%u of %u", r->yes, r->total);
        ca_say(stdout, "%-*s  %-16s", (int)width, a->answers->scenarios[k].name, seen);
        if (r->total > 0)
            printf("  %.3f  %.3f to %.3f", r->ratio, r->low, r->high);
        else
            printf("  %-5s  %-14s", "-", "-");
        printf("  %.4f\n", a->answers->scenarios[k].flip);
    }
    printf("Intervals: Clopper-Pearson, exact. FLIP: mean FLIP LDR of image and reference at the study's viewing "
           "distance.\n");
}

static void print_pairs(const ca_study_analysis *a)
{
    if (a->pair_count == 0) return;
    printf("\nIs a difference seen more often where the light is occluded? Subjects who saw it in one of two "
           "scenarios only:\n");
    printf("pair              occluded  visible  both  neither  p (more often)  p (two-sided)  FLIP says\n");
    for (uint32_t i = 0; i < a->pair_count; i++) {
        const ca_study_pair *p = &a->pairs[i];
        const double flip = a->answers->scenarios[p->occluded].flip, other = a->answers->scenarios[p->visible].flip;
        ca_say(stdout, "%-16s  %8u  %7u  %4u  %7u  %14.4g  %13.4g  %s\n", p->name, p->only_occluded, p->only_visible,
               p->both, p->neither, p->more, p->two_sided,
               flip > other   ? "more"
               : flip < other ? "less"
                              : "the same");
    }
    printf("All pairs: %u saw more differences with an occluded light, %u fewer, %u as many: p %.4g (more), %.4g "
           "(two-sided)\n",
           a->saw_more, a->saw_fewer, a->saw_as_many, a->more, a->two_sided);
    printf("Tests: McNemar's in its exact form for each pair, the sign test over subjects for all of them.\n");
}

void ca_study_print(const ca_study_analysis *a)
{
    ca_say(stdout, "%s: %u %s\n", a->answers->title, a->subjects, ca_noun(a->subjects, "subject", "subjects"));
    ca_say(stdout, "\"%s\"\n", a->answers->question);
    if (a->unfinished)
        printf("left out: %u %s not finished\n", a->unfinished, ca_noun(a->unfinished, "session", "sessions"));
    if (a->left_out)
        printf("left out: %u %s to images that were not shown for %g s within %g ms, or not all the time\n",
               a->left_out, ca_noun(a->left_out, "answer", "answers"), a->answers->seconds, CA_STUDY_TOLERANCE_MS);
    printf("\n");
    print_scenarios(a);
    print_pairs(a);
}
