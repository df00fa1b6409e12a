### Remarks on what machines ship, and on their nights

remark-part_kept_apart = The lake has other content in its place: it is kept apart, below apart/. Was the history begun anew, or have two machines one name?
remark-part_sent_again = The lake's copy was cut and is replaced
remark-shipped_unnoted = What was shipped cannot be noted beside the history ({ $cause }), which therefore does not know it when it deletes old days
remark-part_of_future = Its day has not been: it was rehearsed, or the clock is wrong; it was not sent
remark-part_unreadable = The file is damaged and was not sent; thermaxis history check says more

remark-withdrawn_in_force = The model in force was withdrawn: choose another one on the page of models, or call thermaxis relearn --rollback; the next fetch removes it
remark-proposal_of_other_model = an accepted model is not brought, as another one is in force than the one that it was compared with: choose that again, or call thermaxis fleet withdraw
remark-withdrawn_configured = machine.toml begins with a model that was withdrawn: state another one there, and the next fetch removes it
