### Slova aplikace: její první stránka a konec.

app-end = Ukončit
app-ended = Program skončil. Tuto stránku lze zavřít.
app-no_token = Tato stránka se otevře jen na adrese, kterou program vypsal, s jejím klíčem. Je-li adresa ztracena, spusťte thermaxis app znovu.
