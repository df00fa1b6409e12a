### Errors of reports

error-output_is_pipe = This output is a pipe, which would wait for a reader.
    .remedy = Name a file.
error-other_logs_than_verified = The logs are not those that were verified.
    .remedy = Give the logs of the verification in their order.
error-runs_of_two_kinds = Linear and rotary axes have no figures in common.
    .remedy = Give runs of one axis.
error-certificate_incomplete = A final certificate must state what is missing here: { $missing }.
    .remedy = Fill these keys in the file of --header, or leave --final out for a draft.
error-certificate_date_impossible = A final certificate cannot state this: { $dates }.
    .remedy = Correct it, in the file of --header or after --date, or leave --final out for a draft.
