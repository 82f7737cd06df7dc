"""The fields of a job as they are read: their types, names, labels and errors.

model            the base of all models
json_types       values keep the types of JSON
problems         validation errors, field by field
problem_words    the words for what a field must be
labels           label and unit of a field, as a form shows them
old_names        former names of fields and settings that are still accepted
later_fields     fields that an earlier release does not know, left out of what is stored while unused
"""
