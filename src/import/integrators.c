/* The integrator: its name and parameters are kept as they are; the integrator that is chosen in the end judges
 * them. */
#include "import/importer.h"

#include "import/number.h"

#include <string.h>

enum { MAX_PARAMETERS = 256 };

static void import_value(ca_importer *importer, const ca_xml_node *node, ca_parameter *parameter)
{
    const char *value = ca_xml_attribute_value(node, "value");
    if (strcmp(node->tag, "float") == 0 || strcmp(node->tag, "integer") == 0) {
        parameter->kind = CA_PARAMETER_NUMBER;
        ca_import_numbers(importer, node, "value", &parameter->number, 1);
        if (node->tag[0] == 'i' && parameter->number != rint(parameter->number))
            ca_import_fail(importer, &node->where, "\"%s\" is no integer", value);
    } else if (strcmp(node->tag, "boolean") == 0) {
        parameter->kind = CA_PARAMETER_BOOLEAN;
        parameter->number = strcmp(value, "true") == 0;
        if (strcmp(value, "true") != 0 && strcmp(value, "false") != 0)
            ca_import_fail(importer, &node->where, "\"%s\" is neither \"true\" nor \"false\"", value);
    } else if (strcmp(node->tag, "string") == 0) {
        parameter->kind = CA_PARAMETER_TEXT;
        parameter->text = ca_arena_strdup(&importer->desc->strings, value);
        if (!parameter->text) ca_import_fail_memory(importer, "the integrator");
    } else {
        ca_import_fail(importer, &node->where,
                       "an integrator's parameter is a <float>, <integer>, <boolean> or <string>, not a <%s>",
                       node->tag);
    }
}

static void import_parameter(ca_importer *importer, const ca_xml_node *node)
{
    ca_integrator_desc *integrator = &importer->desc->integrator;
    ca_parameter parameter = {.where = node->where};
    import_value(importer, node, &parameter);
    if (!ca_import_good(importer)) return;
    const char *name = ca_xml_attribute_value(node, "name");
    for (size_t i = 0; i < integrator->parameters.count; i++)
        if (strcmp(integrator->parameters.items[i].name, name) == 0)
            ca_import_fail(importer, &node->where, "parameter \"%s\" is given a second time", name);
    if (integrator->parameters.count == MAX_PARAMETERS)
        ca_import_fail(importer, &node->where, "more than %d parameters", MAX_PARAMETERS);
    parameter.name = ca_arena_strdup(&importer->desc->strings, name);
    if (!parameter.name || !CA_TABLE_ADD(&integrator->parameters)) {
        ca_import_fail_memory(importer, "the integrator");
        return;
    }
    integrator->parameters.items[integrator->parameters.count - 1] = parameter;
}

void ca_import_integrator(ca_importer *importer, ca_xml_node *node)
{
    ca_integrator_desc *integrator = &importer->desc->integrator;
    integrator->where = node->where;
    integrator->name = ca_arena_strdup(&importer->desc->strings, ca_xml_attribute_value(node, "type"));
    if (!integrator->name) ca_import_fail_memory(importer, "the integrator");
    for (const ca_xml_node *child = node->first_child; child && ca_import_good(importer); child = child->next)
        import_parameter(importer, child);
}
