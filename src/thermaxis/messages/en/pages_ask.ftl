### Why a request was not answered by the compensation itself.

ask-no_answer = The compensation has given no answer; the request may still take effect.
ask-lost = The connection was lost before the answer; the request may still take effect.
ask-role = The compensation says that this user may not.
ask-told = { $said }
ask-arguments = The request is not complete, or a value in it cannot be used.
ask-too_many = Several requests of yours wait for their answer already.
ask-not_taken = The compensation did not take the request. The screen's log says more.

## How far a request came before it acts.

ask-model_settles = loaded, settling
ask-model_waits = loaded; acts once the compensation is active
