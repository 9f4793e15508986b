#include "cli/study_answers.h"

#include "base/memory.h"

#include <math.h>
#include <string.h>

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

/* ---- Which study it is ----------------------------------------------------------------------------------------- */

typedef struct study_record {
    const char *id, *title, *question;
    double seconds;
    const ca_json_value *scenarios, *other;
} study_record;

#define STUDY(field) .offset = offsetof(study_record, field)

static const ca_json_field study_fields[] = {
    {.key = "id", .kind = CA_JSON_TEXT, .needed = true, STUDY(id)},
    {.key = "title", .kind = CA_JSON_TEXT, .needed = true, STUDY(title)},
    {.key = "question", .kind = CA_JSON_TEXT, .needed = true, STUDY(question)},
    {.key = "yes", .kind = CA_JSON_ANY, STUDY(other)},
    {.key = "no", .kind = CA_JSON_ANY, STUDY(other)},
    {.key = "seconds", .kind = CA_JSON_NUMBER, .needed = true, .low = 0.0, .high = 1e6, STUDY(seconds)},
    {.key = "screens", .kind = CA_JSON_ANY, STUDY(other)},
    {.key = "viewing_distance_m", .kind = CA_JSON_ANY, STUDY(other)},
    {.key = "monitor_spacing_m", .kind = CA_JSON_ANY, STUDY(other)},
    {.key = "pixel_pitch_mm", .kind = CA_JSON_ANY, STUDY(other)},
    {.key = "pixels_per_degree", .kind = CA_JSON_ANY, STUDY(other)},
    {.key = "magnify", .kind = CA_JSON_ANY, STUDY(other)},
    {.key = "exposure", .kind = CA_JSON_ANY, STUDY(other)},
    {.key = "sides", .kind = CA_JSON_ANY, STUDY(other)},
    {.key = "image", .kind = CA_JSON_ANY, STUDY(other)},
    {.key = "reference", .kind = CA_JSON_ANY, STUDY(other)},
    {.key = "scenarios", .kind = CA_JSON_LIST, .needed = true, STUDY(scenarios)},
};

static ca_status read_scenarios(const ca_json *document, const ca_json_value *list, ca_study_answers *answers,
                                ca_error *error)
{
    /* Pair and light may be empty, which a text may not. */
    static const ca_json_field fields[] = {
        {.key = "name", .kind = CA_JSON_TEXT, .needed = true, .offset = offsetof(ca_study_asked, name)},
        {.key = "light", .kind = CA_JSON_ANY_TEXT, .needed = true, .offset = offsetof(ca_study_asked, light_name)},
        {.key = "pair", .kind = CA_JSON_ANY_TEXT, .needed = true, .offset = offsetof(ca_study_asked, pair)},
        {.key = "flip",
         .kind = CA_JSON_NUMBER,
         .needed = true,
         .low = 0.0,
         .high = 1.0,
         .offset = offsetof(ca_study_asked, flip)},
    };
    const size_t count = ca_json_size(list);
    answers->scenarios = ca_alloc_zeroed(count, sizeof *answers->scenarios);
    if (!answers->scenarios) return ca_fail_memory(error, "the answers");
    for (; answers->scenario_count < count; answers->scenario_count++) {
        ca_study_asked *s = &answers->scenarios[answers->scenario_count];
        const ca_json_value *object;
        CA_TRY(ca_json_object_at(document, list, answers->scenario_count, "a scenario", &object, error));
        CA_TRY(ca_json_fill(document, object, "a scenario", fields, COUNT(fields), s, error));
        if (!ca_study_light_find(s->light_name, &s->light))
            return ca_json_fail(document, object, "light", error,
                                "\"light\": expected \"visible\", \"occluded\" or \"\"");
    }
    return CA_OK;
}

/* The first file says which study it is; the others must be of the same. */
static ca_status read_study(const ca_json *document, const ca_json_value *root, const ca_json_value *object,
                            const char *first, ca_study_answers *answers, ca_error *error)
{
    study_record study = {0};
    CA_TRY(ca_json_fill(document, object, "\"study\"", study_fields, COUNT(study_fields), &study, error));
    if (answers->id && strcmp(answers->id, study.id) == 0) return CA_OK;
    if (answers->id)
        return ca_json_fail(document, root, "study", error,
                            "these answers are of another study (%.40s) than those of %.400s (%.40s)", study.id,
                            first, answers->id);
    answers->id = study.id;
    answers->title = study.title;
    answers->question = study.question;
    answers->seconds = study.seconds;
    return read_scenarios(document, study.scenarios, answers, error);
}

/* ---- Sessions -------------------------------------------------------------------------------------------------- */

typedef struct trial_record {
    const char *scenario, *disturbed;
    double shown_ms;
    bool difference;
    const ca_json_value *other;
} trial_record;

#define TRIAL(field) .offset = offsetof(trial_record, field)

static const ca_json_field trial_fields[] = {
    {.key = "scenario", .kind = CA_JSON_TEXT, .needed = true, TRIAL(scenario)},
    {.key = "reference_side", .kind = CA_JSON_ANY, TRIAL(other)},
    {.key = "shown_ms", .kind = CA_JSON_NUMBER, .needed = true, .low = 0.0, .high = 1e9, TRIAL(shown_ms)},
    {.key = "disturbed", .kind = CA_JSON_ANY_TEXT, .needed = true, TRIAL(disturbed)},
    {.key = "difference", .kind = CA_JSON_FLAG, .needed = true, TRIAL(difference)},
    {.key = "answer_ms", .kind = CA_JSON_ANY, TRIAL(other)},
};

static ca_status read_trials(const ca_json *document, const ca_json_value *list, const ca_study_answers *answers,
                             ca_study_answer *result, ca_error *error)
{
    for (size_t i = 0; i < ca_json_size(list); i++) {
        trial_record trial = {0};
        const ca_json_value *object;
        CA_TRY(ca_json_object_at(document, list, i, "a trial", &object, error));
        CA_TRY(ca_json_fill(document, object, "a trial", trial_fields, COUNT(trial_fields), &trial, error));
        uint32_t k = 0;
        while (k < answers->scenario_count && strcmp(answers->scenarios[k].name, trial.scenario) != 0) k++;
        if (k == answers->scenario_count)
            return ca_json_fail(document, object, "scenario", error, "the study has no scenario \"%.100s\"",
                                trial.scenario);
        if (result[k] != CA_STUDY_NOT_ASKED)
            return ca_json_fail(document, object, "scenario", error,
                                "scenario \"%.100s\" has been asked before in this session", trial.scenario);
        const bool in_time = fabs(trial.shown_ms - 1000.0 * answers->seconds) <= CA_STUDY_TOLERANCE_MS;
        result[k] = !in_time || trial.disturbed[0] ? CA_STUDY_LEFT_OUT
                    : trial.difference             ? CA_STUDY_YES
                                                   : CA_STUDY_NO;
    }
    return CA_OK;
}

typedef struct session_record {
    const char *subject, *session;
    const ca_json_value *trials, *other;
    bool finished;
} session_record;

#define SESSION(field) .offset = offsetof(session_record, field)

static const ca_json_field session_fields[] = {
    {.key = "subject", .kind = CA_JSON_TEXT, .needed = true, SESSION(subject)},
    {.key = "session", .kind = CA_JSON_TEXT, .needed = true, SESSION(session)},
    {.key = "started", .kind = CA_JSON_ANY, SESSION(other)},
    {.key = "screens", .kind = CA_JSON_ANY, SESSION(other)},
    {.key = "viewing_distance_m", .kind = CA_JSON_ANY, SESSION(other)},
    {.key = "monitor_spacing_m", .kind = CA_JSON_ANY, SESSION(other)},
    {.key = "display", .kind = CA_JSON_ANY, SESSION(other)},
    {.key = "order", .kind = CA_JSON_ANY, SESSION(other)},
    {.key = "trials", .kind = CA_JSON_LIST, .needed = true, SESSION(trials)},
    {.key = "finished", .kind = CA_JSON_FLAG, .needed = true, SESSION(finished)},
};

/* A session that is there already: what one of the two has not is taken from the other. */
static ca_status join(const ca_json *document, const ca_json_value *object, const ca_study_answers *answers,
                      ca_study_subject *known, const ca_study_subject *added, ca_error *error)
{
    for (uint32_t k = 0; k < answers->scenario_count; k++) {
        if (known->answers[k] == CA_STUDY_NOT_ASKED) known->answers[k] = added->answers[k];
        if (added->answers[k] != CA_STUDY_NOT_ASKED && added->answers[k] != known->answers[k])
            return ca_json_fail(document, object, "session", error, "this session has other answers in %.400s",
                                known->file);
    }
    known->finished = known->finished || added->finished;
    return CA_OK;
}

static ca_status add_subject(const ca_json *document, const ca_json_value *object, const ca_study_subject *added,
                             ca_study_answers *answers, bool *taken, ca_error *error)
{
    for (size_t i = 0; i < answers->subject_count; i++) {
        ca_study_subject *known = &answers->subjects[i];
        if (strcmp(known->session, added->session) == 0) return join(document, object, answers, known, added, error);
        if (strcmp(known->subject, added->subject) == 0)
            return ca_json_fail(document, object, "subject", error,
                                "subject \"%.100s\" has taken part before, in %.400s; expected one session of each",
                                added->subject, known->file);
    }
    ca_study_subject *subjects =
        ca_array_grow(answers->subjects, &answers->subject_capacity, answers->subject_count + 1, sizeof *subjects);
    if (!subjects) return ca_fail_memory(error, "the answers");
    answers->subjects = subjects;
    answers->subjects[answers->subject_count++] = *added;
    *taken = true;
    return CA_OK;
}

static ca_status read_session(const ca_json *document, const ca_json_value *object, const char *path,
                              ca_study_answers *answers, ca_error *error)
{
    session_record session = {0};
    CA_TRY(ca_json_fill(document, object, "a session", session_fields, COUNT(session_fields), &session, error));
    ca_study_subject added = {
        .subject = session.subject, .session = session.session, .file = path, .finished = session.finished};
    added.answers = ca_alloc_zeroed(answers->scenario_count, sizeof *added.answers);
    if (!added.answers) return ca_fail_memory(error, "the answers");
    bool taken = false;
    ca_status status = read_trials(document, session.trials, answers, added.answers, error);
    if (status == CA_OK) status = add_subject(document, object, &added, answers, &taken, error);
    if (!taken) ca_free(added.answers);
    return status;
}

/* ---- Files ----------------------------------------------------------------------------------------------------- */

typedef struct file_record {
    const char *format;
    uint32_t version;
    const ca_json_value *study, *sessions, *other;
} file_record;

static ca_status read_file(const char *path, const char *first, ca_study_answers *answers, ca_error *error)
{
    static const ca_json_field fields[] = {
        {.key = "format", .kind = CA_JSON_TEXT, .needed = true, .offset = offsetof(file_record, format)},
        {.key = "version",
         .kind = CA_JSON_COUNT,
         .needed = true,
         .low = 1,
         .high = 1,
         .offset = offsetof(file_record, version)},
        {.key = "exported", .kind = CA_JSON_ANY, .offset = offsetof(file_record, other)},
        {.key = "study", .kind = CA_JSON_OBJECT, .needed = true, .offset = offsetof(file_record, study)},
        {.key = "sessions", .kind = CA_JSON_LIST, .needed = true, .offset = offsetof(file_record, sessions)},
    };
    ca_json *document;
    CA_TRY(ca_json_read(path, "answers", &document, error));
    answers->documents[answers->document_count++] = document;
    const ca_json_value *root = ca_json_root(document);
    file_record file = {0};
    CA_TRY(ca_json_fill(document, root, "a file of answers", fields, COUNT(fields), &file, error));
    if (strcmp(file.format, "caustica study answers") != 0)
        return ca_json_fail(document, root, "format", error, "\"format\": expected \"caustica study answers\"");
    CA_TRY(read_study(document, root, file.study, first, answers, error));
    for (size_t i = 0; i < ca_json_size(file.sessions); i++) {
        const ca_json_value *object;
        CA_TRY(ca_json_object_at(document, file.sessions, i, "a session", &object, error));
        CA_TRY(read_session(document, object, path, answers, error));
    }
    return CA_OK;
}

ca_status ca_study_answers_read(const char *const *paths, size_t count, ca_study_answers *answers, ca_error *error)
{
    *answers = (ca_study_answers){.documents = ca_alloc_zeroed(count, sizeof *answers->documents)};
    if (!answers->documents) return ca_fail_memory(error, "the answers");
    for (size_t i = 0; i < count; i++) CA_TRY(read_file(paths[i], paths[0], answers, error));
    return CA_OK;
}

void ca_study_answers_destroy(ca_study_answers *answers)
{
    for (size_t i = 0; i < answers->subject_count; i++) ca_free(answers->subjects[i].answers);
    for (size_t i = 0; i < answers->document_count; i++) ca_json_destroy(answers->documents[i]);
    ca_free(answers->subjects);
    ca_free(answers->scenarios);
    ca_free(answers->documents);
    *answers = (ca_study_answers){0};
}
